// Elements of a form: fields for numbers and texts, choices, and sliders with a number beside them.

import { digits, entered, parsed, quoted } from "./numbers.js";

const STEPS = 2000;

export function element(name, properties = {}, parent = null) {
  const made = Object.assign(document.createElement(name), properties);
  parent?.append(made);
  return made;
}

/**
 * A field for a number; `told(value, variable)` is called with all that is typed and left, as `entered` has it. What is none is
 * marked. With `names` of variables it takes expressions, with `pair` also two of them.
 */
export function field(parent, { words, value = "", unit = "", key = "", names = null, pair = false }, told) {
  const input = row(parent, { words, value, unit, key });
  if (!names) input.inputMode = "decimal";
  input.addEventListener("change", () => {
    const { problem, ...found } = entered(input.value, { unit, names, pair });
    marked(input, problem ? `${words}: ${problem}` : "");
    if (!problem) told(found.value, found.variable);
  });
  return input;
}

/** A field for a text; `told` is called with what is typed and left. */
export function texts(parent, { words, value = "", unit = "", key = "", placeholder = "" }, told) {
  const input = row(parent, { words, value, unit, key });
  Object.assign(input, { placeholder, spellcheck: false });
  input.addEventListener("change", () => told(input.value.trim(), input));
  return input;
}

function row(parent, { words, value, unit, key }) {
  const place = element("div", { className: "field" }, parent);
  const label = element("label", {}, place);
  element("span", { textContent: words }, label);
  const input = element("input", { value: value ?? "", autocomplete: "off" }, label);
  Object.assign(input.dataset, { key, was: input.value });
  element("span", { className: "unit", textContent: unit ?? "" }, place);
  // The next key is for the board again.
  input.addEventListener("keydown", ({ key }) => {
    if (key === "Escape") input.value = input.dataset.was;
    if (key === "Enter") input.blur();
  });
  return input;
}

/** A list to choose from; `told` is called with what is chosen. */
export function choice(parent, { words, value, options, key = "" }, told) {
  const label = element("label", { className: "field", textContent: `${words} ` }, parent);
  const select = element("select", {}, label);
  select.dataset.key = key;
  for (const option of options) element("option", { value: option, textContent: option || "as usual", selected: option === value }, select);
  select.addEventListener("input", () => told(select.value));
  return select;
}

/** Says of a field what is wrong with it; nothing where it is right. */
export function marked(input, problem) {
  input.setAttribute("aria-invalid", Boolean(problem));
  input.title = problem;
  input.dispatchEvent(new CustomEvent("marked", { bubbles: true, detail: problem }));
}

/** A slider with a number beside it; `moved` is called with every new value, `rested` when it is let go. */
export function slider(parent, { name, words, unit, low, high, value, fits = [] }, moved, rested = () => {}) {
  const row = element("div", { className: "slider" }, parent);
  row.dataset.name = name;
  const label = element("label", {}, row);
  element("span", { textContent: words }, label);
  const decimals = Math.max(0, Math.min(12, Math.ceil(Math.log10(STEPS / (high - low || 1)))));
  const range = element("input", { type: "range", min: low, max: high, step: fits.length ? 1 : "any", value }, label);
  if (fits.length) {
    // A fit stays a fit: the slider steps through them.
    const told = element("output", {}, row);
    element("span", { className: "unit", textContent: unit }, row);
    const say = () => {
      const [fit, least, most] = fits[Number(range.value)];
      told.textContent = `${fit}: ${digits(least)} to ${digits(most)}`;
      range.setAttribute("aria-valuetext", told.textContent);
    };
    range.addEventListener("input", () => (say(), moved(Number(range.value))));
    range.addEventListener("change", rested);
    say();
    return (next) => ((range.value = next), say());
  }
  const number = element("input", { inputMode: "decimal", autocomplete: "off", value: digits(value) }, row);
  number.setAttribute("aria-label", words);
  element("span", { className: "unit", textContent: unit }, row);
  range.addEventListener("input", () => {
    const next = Number(Number(range.value).toFixed(decimals));
    number.value = next;
    marked(number, "");
    moved(next);
  });
  number.addEventListener("input", () => {
    const next = parsed(number.value);
    marked(number, next === null && number.value !== "" ? `${words}: ${quoted(number.value)} is not a number` : "");
    if (next === null) return;
    range.value = next;
    moved(next);
  });
  number.addEventListener("keydown", ({ key }) => key === "Enter" && number.blur());
  for (const one of [range, number]) one.addEventListener("change", rested);
  return (next) => {
    range.value = next;
    number.value = digits(next);
  };
}
