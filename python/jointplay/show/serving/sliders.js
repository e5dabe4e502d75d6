// Elements of a form: numbers as people type them, and sliders with a number beside them.

const STEPS = 2000;

export function element(name, properties = {}, parent = null) {
  const made = Object.assign(document.createElement(name), properties);
  parent?.append(made);
  return made;
}

/** A number with a decimal point or a decimal comma; null of what is none. */
export function parsed(text) {
  const plain = String(text).trim().replace(",", ".");
  const number = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
  return Number.isFinite(number) ? number : null;
}

/** A number as it is shown. */
export const digits = (value) => String(Number(value.toPrecision(6)));

/** A field for a number; `told` is called with every number that is typed and left. What is none is marked. */
export function field(parent, { words, value = "", unit = "", key = "" }, told) {
  const row = element("div", { className: "field" }, parent);
  const label = element("label", {}, row);
  element("span", { textContent: words }, label);
  const input = element("input", { inputMode: "decimal", value: value ?? "", autocomplete: "off" }, label);
  Object.assign(input.dataset, { key, was: input.value });
  element("span", { className: "unit", textContent: unit }, row);
  // The next key is for the board again.
  input.addEventListener("keydown", ({ key }) => {
    if (key === "Escape") input.value = input.dataset.was;
    if (key === "Enter") input.blur();
  });
  input.addEventListener("change", () => {
    const number = parsed(input.value);
    const isEmpty = input.value.trim() === "";
    marked(input, number === null && !isEmpty ? `${words}: '${input.value}' is not a number` : "");
    if (number !== null || isEmpty) told(number);
  });
  return input;
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
    marked(number, next === null && number.value !== "" ? `${words}: '${number.value}' is not a number` : "");
    if (next === null) return;
    range.value = next;
    moved(next);
  });
  for (const one of [range, number]) one.addEventListener("change", rested);
  return (next) => {
    range.value = next;
    number.value = digits(next);
  };
}
