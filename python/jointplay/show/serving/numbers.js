// Numbers as people type them: with a decimal point or comma, in another unit, as an expression of variables, or with a name for it.

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
/** Letters of what was typed that a message repeats. */
const LONGEST = 60;
/** Millimetres in a unit of length. */
const LENGTHS = { um: 1e-3, mm: 1, cm: 10, m: 1000, in: 25.4, inch: 25.4 };
/** What expressions have beside variables. */
const FUNCTIONS = ["pi", "sqrt", "hypot", "abs", "min", "max", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"];

/** A number with a decimal point or a decimal comma; null of what is none. */
export function parsed(text) {
  const plain = String(text).trim().replace(",", ".");
  const number = NUMBER.test(plain) ? Number(plain) : NaN;
  return Number.isFinite(number) ? number : null;
}

/** What was typed, in a message: its beginning where it is long. */
export const quoted = (text) => `'${text.length > LONGEST ? `${text.slice(0, LONGEST)}…` : text}'`;

/** A number as it is shown. */
export const digits = (value) => (typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value));

/**
 * What is typed into a field: `{ value }`, a number, null of nothing, or an expression as a text; `{ variable: [name, value] }` with
 * it where `name = value` is typed; `{ problem }` of what is none of these. Without `names` of variables there are numbers only.
 * Of a `pair` the value of `lowest; highest` is a list of both.
 */
export function entered(text, { unit = "", names = null, pair = false } = {}) {
  const plain = text.trim();
  if (!plain) return { value: null };
  if (pair && plain.includes(";")) {
    const ends = plain.split(";").map((part) => entered(part, { unit, names }));
    const { problem } = ends.find((end) => end.problem) ?? {};
    if (problem) return { problem };
    const isPair = ends.length === 2 && ends.every(({ value, variable }) => value !== null && !variable);
    return isPair ? { value: ends.map(({ value }) => value) } : { problem: `${quoted(plain)} is not a lowest and a highest value, such as -5; 8` };
  }
  const number = parsed(plain);
  if (number !== null) return { value: number };
  const problem = `${quoted(plain)} is not a number`;
  const measured = /^(.*\d)\s*([a-z]+)$/i.exec(plain);
  const by = measured && LENGTHS[measured[2]] / LENGTHS[unit];
  if (by && parsed(measured[1]) !== null) return { value: Number((parsed(measured[1]) * by).toPrecision(12)) };
  if (!names) return { problem };
  const [, name, rest] = /^([A-Za-z]\w*)\s*=\s*([^=]+)$/.exec(plain) ?? [];
  if (name) {
    const found = entered(rest, { unit, names: names.filter((one) => one !== name) });
    return found.problem || found.value === null ? { problem: found.problem ?? problem } : { value: name, variable: [name, found.value] };
  }
  const own = plain.replace(/^=\s*/, "");
  // Within parentheses a comma is between two numbers.
  const value = own.includes("(") ? own : own.replace(/(\d),(\d)/g, "$1.$2");
  // Neither two decimal signs in a number nor two numbers without a sign between them.
  if (!/^[\w\s.+\-*/(),]+$/.test(value) || /\d\.\d*\.|[\w.]\s+[\w.]/.test(value)) return { problem };
  const unknown = (value.match(/(?<![\w.])[A-Za-z_]\w*/g) ?? []).find((word) => !names.includes(word) && !FUNCTIONS.includes(word));
  return unknown ? { problem: `${problem}, and ${quoted(unknown)} is no variable${unknown.length > LONGEST ? "" : `: ${unknown} = 3 makes one`}` } : { value };
}
