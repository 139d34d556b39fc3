// Elements made one by one, so that data from a ship file or from the wire are only ever text on the page.

/** An HTML element with attributes (true: without a value; null, false and undefined: left out) and children. */
export const make = (tag, given = {}, ...children) => filled(document.createElement(tag), given, children);

/** The same for SVG; takes the name space of a drawing that the page already has. */
export const drawn = (tag, given = {}, ...children) =>
  filled(document.createElementNS(document.querySelector("svg").namespaceURI, tag), given, children);

function filled(element, given, children) {
  for (const [name, value] of Object.entries(given))
    if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  element.append(...children);
  return element;
}
