// The table of cells: sorting by a press on a heading, a filter whose every word must occur in the
// row, one verdict alone, and a hundred rows at a time. Rows are data; what is shown is made of text only.
const data = JSON.parse(document.getElementById("cells-data").textContent);
const table = document.querySelector("table.sortable");
const headings = [...table.querySelectorAll("thead th")];
const [filter, chosen, shown, more] = ["filter", "verdict", "shown", "more"].map((id) => document.getElementById(id));
const textOf = (field) => (Array.isArray(field) ? field[1] : field);
const keyOf = (field) => (Array.isArray(field) ? field[0] : field);
let limit = data.step;
let order = data.rows;

const element = (name, content, className) => {
  const made = document.createElement(name);
  made.append(content);
  if (className) made.className = className;
  return made;
};

const drawn = (row) => {
  const line = document.createElement("tr");
  row.fields.forEach((field, column) => {
    const text = textOf(field);
    if (column === 0) {
      const link = element("a", text);
      link.href = row.href;
      line.append(element("td", link));
    } else if (column === data.verdict) {
      const badge = element("span", text, "verdict");
      badge.style.setProperty("--mark", data.colours[keyOf(field)]);
      line.append(element("td", badge));
    } else {
      line.append(element("td", text, column > data.verdict ? "number" : ""));
    }
  });
  return line;
};

const matching = () => {
  const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
  return order.filter((row) => {
    if (chosen.value !== "" && keyOf(row.fields[data.verdict]) !== Number(chosen.value)) return false;
    row.text ??= row.fields.map(textOf).join(" ").toLowerCase();
    return words.every((word) => row.text.includes(word));
  });
};

const show = () => {
  const rows = matching();
  table.tBodies[0].replaceChildren(...rows.slice(0, limit).map(drawn));
  count(rows.length);
};

const count = (n) => {
  shown.textContent = `${Math.min(limit, n)} of ${n} shown`;
  more.hidden = n <= limit;
};

headings.forEach((heading, column) => {
  heading.querySelector("button").addEventListener("click", () => {
    const rising = heading.getAttribute("aria-sort") === "descending";
    headings.forEach((other) => other.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", rising ? "ascending" : "descending");
    order = [...data.rows].sort((a, b) => {
      const [x, y] = [keyOf(a.fields[column]), keyOf(b.fields[column])];
      if (x === null || y === null) return (x === null) - (y === null);
      const least = typeof x === "number" ? x - y : x.localeCompare(y, "en", { numeric: true });
      return rising ? least : -least;
    });
    show();
  });
});
filter.addEventListener("input", () => {
  limit = data.step;
  show();
});
chosen.addEventListener("change", () => {
  limit = data.step;
  show();
});
more.addEventListener("click", () => {
  limit += data.step;
  show();
});
count(data.rows.length);
