// The table of cells: sorting by a press on a heading, a filter of words and of conditions such as
// radius = 10, one verdict alone, and a hundred rows at a time. Rows are data; what is shown is text only.
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
      const link = row.href ? element("a", text) : text;
      if (row.href) link.href = row.href;
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

// A column by its name, a word of its name, or the beginning of one: radius is "radius D (m)".
const columnOf = (name) => {
  const wanted = name.toLowerCase();
  const tests = [
    (known) => known === wanted,
    (known) => known.split(/[^\p{L}\p{N}₀-₉ₒₜ]+/u).includes(wanted),
    (known) => known.split(/[^\p{L}\p{N}₀-₉ₒₜ]+/u).some((word) => word.startsWith(wanted)),
  ];
  for (const test of tests) {
    const column = data.names.findIndex((names) => names.some(test));
    if (column >= 0) return column;
  }
  return -1;
};
const compare = {
  "=": (a, b) => a === b,
  "!=": (a, b) => a !== b,
  "<": (a, b) => a < b,
  ">": (a, b) => a > b,
  "<=": (a, b) => a <= b,
  ">=": (a, b) => a >= b,
};
// Conditions and the words between them. A condition on no column is words too: labels may hold any sign.
const understood = (text) => {
  const conditions = [];
  let unknown = "";
  const words = text.replace(/([^\s<>=!]+)\s*(<=|>=|!=|=|<|>)\s*("[^"]*"|\S+)/gu, (all, name, sign, value) => {
    const column = columnOf(name);
    if (column < 0) {
      unknown = name;
      return all;
    }
    const wanted = value.replaceAll('"', "").replace(/%$/, "").toLowerCase();
    const number = Number(wanted) / (data.percent.includes(column) ? 100 : 1);
    conditions.push((row) => {
      const field = row.fields[column];
      const key = keyOf(field);
      if (key === null) return false;
      if (data.numeric.includes(column) && wanted !== "" && !Number.isNaN(number)) return compare[sign](key, number);
      const own = textOf(field).toLowerCase();
      return sign === "!=" ? !own.startsWith(wanted) : sign === "=" && own.startsWith(wanted);
    });
    return " ";
  });
  return { conditions, unknown, words: words.toLowerCase().split(/\s+/).filter(Boolean) };
};

const matching = () => {
  const wanted = understood(filter.value);
  const rows = order.filter((row) => {
    if (chosen.value !== "" && keyOf(row.fields[data.verdict]) !== Number(chosen.value)) return false;
    row.text ??= row.fields.map(textOf).join(" ").toLowerCase();
    return wanted.words.every((word) => row.text.includes(word)) && wanted.conditions.every((is) => is(row));
  });
  return { rows, unknown: wanted.unknown };
};

const show = () => {
  const { rows, unknown } = matching();
  table.tBodies[0].replaceChildren(...rows.slice(0, limit).map(drawn));
  count(rows.length);
  if (unknown && rows.length === 0) shown.textContent = `no column is called ${unknown}`;
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
