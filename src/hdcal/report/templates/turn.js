// Lets tables be sorted by their titles, searched, and turned page by page. On paper
// stands all that was found; without this script the first page.
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

  function show(most = size) {
    const last = Math.min(first + most, found.length);
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
    const falls = title.getAttribute("aria-sort") === "ascending";
    for (const each of titles) each.removeAttribute("aria-sort");
    title.setAttribute("aria-sort", falls ? "descending" : "ascending");
    const keys = new Map(rows.map(row => [row, key(row, at, isNumber)]));
    const missing = row => Number.isNaN(keys.get(row));
    order = [...rows].sort((one, two) => missing(one) - missing(two) || (falls ? -1 : 1) * (
      isNumber ? keys.get(one) - keys.get(two)
        : keys.get(one).localeCompare(keys.get(two), undefined, {numeric: true})));
    search();
  }

  for (const title of titles) {
    if (!title.textContent.trim()) continue;
    const button = document.createElement("button");
    button.append(...title.childNodes);
    button.addEventListener("click", () => sort(title));
    title.append(button);
  }
  addEventListener("beforeprint", () => { first = 0; show(found.length); });
  addEventListener("afterprint", () => show());
  wanted.addEventListener("input", search);
  for (const body of [...table.tBodies].slice(1)) body.remove();
  if (rows.length > size) room.before(bar);
  table.classList.add("turned");
  show();
}
for (const table of document.querySelectorAll("table[data-page]")) turn(table);
