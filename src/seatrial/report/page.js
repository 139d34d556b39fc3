// Tables sort by a click on a heading, and the data of a figure unpack into a CSV; without scripts both stay as they are.
"use strict";
const value = (cell) => {
  const text = cell.textContent.trim().replace("−", "-").replace(/[, ](?=\d{3})/g, "");
  return /^[-+±]?\.?\d/.test(text) ? parseFloat(text.replace("±", "")) : text.toLowerCase();
};
const compare = (a, b) => {
  if (typeof a === typeof b) return a < b ? -1 : a > b ? 1 : 0;
  return typeof a === "number" ? -1 : 1; // numbers before words and dashes
};
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0];
  if (!body || body.rows.length < 3 || !table.tHead) continue;
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.tabIndex = 0;
    head.title = "sort";
    const sort = () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...body.rows].sort((a, b) => compare(value(a.cells[column]), value(b.cells[column])));
      body.append(...(down ? rows.reverse() : rows));
    };
    head.addEventListener("click", sort);
    head.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      sort();
    });
  });
}
if ("DecompressionStream" in window) {
  for (const link of document.querySelectorAll("a.data")) {
    link.addEventListener("click", async (event) => {
      event.preventDefault();
      const bytes = Uint8Array.from(atob(link.href.split(",")[1]), (letter) => letter.charCodeAt(0));
      const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      const file = document.createElement("a");
      file.href = URL.createObjectURL(new Blob([await new Response(plain).blob()], { type: "text/csv" }));
      file.download = link.download.replace(/\.gz$/, "");
      file.click();
      URL.revokeObjectURL(file.href);
    });
  }
}
