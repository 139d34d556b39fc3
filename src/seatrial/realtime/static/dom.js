// Elements made one by one: what comes from a ship file or from the wire is text on the page and nothing else.

/** An element of HTML with attributes (true is one without a value; null, false and undefined are none) and children. */
export const make = (tag, given = {}, ...children) => filled(document.createElement(tag), given, children);

/** The same of SVG, on a page that has a drawing already: its name space is that of this one. */
export const drawn = (tag, given = {}, ...children) =>
  filled(document.createElementNS(document.querySelector("svg").namespaceURI, tag), given, children);

function filled(element, given, children) {
  for (const [name, value] of Object.entries(given))
    if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  element.append(...children);
  return element;
}
