// Lets tables be sorted by a click on a title, searched, and turned page by page.
// Without this their first page stays.
"use strict";
function turn(table) {
  const size = Number(table.dataset.page);
  const rows = [...table.querySelectorAll("tbody tr")];
  const words = new Map(rows.map(row => [row, row.textContent.toLowerCase()]));
  const titles = [...table.querySelectorAll("th")];
  let found = rows, order = rows, first = 0;

  const bar = document.createElement("div"), room = table.parentElement;
  bar.className = "turn";
  const wanted = document.createElement("input"), told = document.createElement("span");
  wanted.type = "search";
  wanted.placeholder = wanted.ariaLabel = "search";
  told.setAttribute("role", "status");
  const [back, on] = [["‹", "page before", -1], ["›", "next page", 1]].map(([sign, label, way]) => {
    const made = document.createElement("button");
    made.textContent = sign;
    made.ariaLabel = label;
    made.addEventListener("click", () => { first += way * size; show(); });
    return made;
  });
  bar.append(wanted, told, back, on);

  function show() {
    const last = Math.min(first + size, found.length);
    table.tBodies[0].replaceChildren(...found.slice(first, last));
    told.textContent = found.length ? `${first + 1} to ${last} of ${found.length}` : "none";
    back.disabled = first === 0;
    on.disabled = last === found.length;
  }

  function search() {
    const text = wanted.value.trim().toLowerCase();
    found = order.filter(row => words.get(row).includes(text));
    first = 0;
    show();
  }

  // What a cell is sorted by: its first number, where there is one in a column of these.
  function key(row, at, isNumber) {
    const text = row.cells[at].textContent.trim();
    if (!isNumber) return text;
    const number = parseFloat((text.match(/[-+]?\d+(\.\d+)?(e[-+]?\d+)?/i) || [])[0]);
    // Less than 1 % comes before 1 %, more than 99 % behind it.
    return number + (text.startsWith("<") ? -1e-9 : text.startsWith(">") ? 1e-9 : 0);
  }

  function sort(title) {
    const at = title.cellIndex, isNumber = title.classList.contains("number");
    const falls = title.ariaSort === "ascending";
    for (const each of titles) each.ariaSort = null;
    title.ariaSort = falls ? "descending" : "ascending";
    const keys = new Map(rows.map(row => [row, key(row, at, isNumber)]));
    const missing = row => Number.isNaN(keys.get(row));
    order = rows.toSorted((one, two) => missing(one) - missing(two) || (falls ? -1 : 1) * (
      isNumber ? keys.get(one) - keys.get(two)
        : keys.get(one).localeCompare(keys.get(two), undefined, {numeric: true})));
    search();
  }

  for (const title of titles) {
    title.tabIndex = 0;
    title.addEventListener("click", () => sort(title));
    title.addEventListener("keydown", event => { if (event.key === "Enter") sort(title); });
  }
  wanted.addEventListener("input", search);
  for (const body of [...table.tBodies].slice(1)) body.remove();
  if (rows.length > size) room.before(bar);
  table.classList.add("turned");
  show();
}
for (const table of document.querySelectorAll("table[data-page]")) turn(table);
