// Small helpers for the document. Text only ever goes in as text.

export const byId = (id) => document.getElementById(id);

/** An element with a class, text and attributes. */
export function make(tag, text = "", attributes = {}) {
  const element = document.createElement(tag);
  element.textContent = text;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

/** Set text where it has changed: an untouched document needs no layout. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A list of names and values in a <dl>; rows are kept from one call to the next. */
export function figures(list, entries) {
  const names = entries.map(([name]) => name).join("|");
  if (list.dataset.names !== names) {
    list.dataset.names = names;
    list.replaceChildren(...entries.map(([name]) => {
      const row = make("div");
      row.append(make("dt", name), make("dd"));
      return row;
    }));
  }
  entries.forEach(([, value, bad], i) => {
    const cell = list.children[i].lastChild;
    say(cell, value);
    cell.classList.toggle("bad", Boolean(bad));
  });
}

/** Options of a <select>; the choice stays. */
export function options(select, names, chosen) {
  if (select.dataset.names !== names.join("|")) {
    select.dataset.names = names.join("|");
    select.replaceChildren(...names.map((name) => make("option", name, { value: name })));
  }
  if (document.activeElement !== select && select.value !== chosen) select.value = chosen;
  select.hidden = names.length === 0;
}

/** So many digits after the point; what rounds to zero has no sign. */
export function fixed(value, digits) {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

/** A number with a unit; a dash where unknown. */
export function number(value, digits, unit = "") {
  if (value === null || value === undefined) return "–";
  return `${fixed(value, digits)}${unit && " " + unit}`;
}
