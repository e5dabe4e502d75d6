// States that are kept to compare with: their numbers side by side, their drawing as a ghost behind the present one. The browser
// keeps them under the name of the file, as what is not saved.

import { element } from "./sliders.js";
import { short } from "./charts.js";

const KEY = "jointplay.variants ";
const QUANTITIES = ["position", "rotation"];

export class Variants {
  constructor(place, { kept, present, restored, ghost, seen }) {
    Object.assign(this, { place, kept, present, restored, ghost, told: seen, all: [], seen: null, count: 0 });
    const bar = element("div", { className: "bar" }, place);
    element("button", { type: "button", id: "keep", textContent: "keep the present one" }, bar).addEventListener("click", () => this.keep());
    this.table = element("div", {}, place);
  }

  /** Those of a file; of a new drawing there are none. */
  begin(name, isNew) {
    const all = (!isNew && read(KEY + name)) || [];
    Object.assign(this, { name, all, seen: null, count: all.length });
    this.show();
  }

  /** The file has another name. */
  named(name) {
    this.name = name;
    if (this.all.length) this.store();
  }

  store() {
    try {
      const kept = this.all.map((variant) => ({ ...variant, state: { ...variant.state, picture: undefined } }));
      if (kept.length) localStorage.setItem(KEY + this.name, JSON.stringify(kept));
      else localStorage.removeItem(KEY + this.name);
    } catch {
      // Where the browser keeps nothing, they are there as long as the page is.
    }
  }

  keep() {
    this.count += 1;
    this.all.push({ name: `variant ${this.count}`, ...this.kept(), ...structuredClone(this.present()) });
    this.store();
    this.show();
  }

  /** The present drawing is another one: its ghost stays. */
  shown() {
    this.ghost(this.seen?.scene ?? null);
  }

  show() {
    this.table.replaceChildren();
    if (!this.all.length) return;
    const table = element("table", {}, this.table);
    const head = element("tr", {}, element("thead", {}, table));
    element("th", { textContent: "at the position where it was kept" }, head);
    for (const variant of this.all) {
      const cell = element("th", {}, head);
      const name = element("input", { value: variant.name, size: 10 }, cell);
      name.setAttribute("aria-label", "name of the variant");
      name.addEventListener("change", () => {
        variant.name = name.value;
        this.store();
      });
      const ghost = element("input", { type: "checkbox", checked: this.seen === variant }, element("label", { textContent: "ghost " }, cell));
      ghost.addEventListener("input", () => {
        this.seen = ghost.checked ? variant : null;
        this.shown();
        this.told();
        this.show();
      });
      element("button", { type: "button", textContent: "go back to it" }, cell).addEventListener("click", () => this.restored(variant.state));
      element("button", { type: "button", textContent: "drop" }, cell).addEventListener("click", () => {
        this.all = this.all.filter((one) => one !== variant);
        this.store();
        if (this.seen === variant) this.seen = null;
        this.shown();
        this.show();
      });
    }
    element("th", { textContent: "the present one, here" }, head);
    this.body = element("tbody", {}, table);
    this.filled();
  }

  /** The numbers of all that are kept, and of the present one. */
  filled() {
    if (!this.all.length) return;
    const every = [...this.all, this.present()];
    const words = Object.assign({}, ...every.map((variant) => variant.words));
    const rows = [];
    for (const [question, told] of Object.entries(words)) {
      for (const quantity of QUANTITIES) {
        const cells = every.map(({ numbers }) => {
          const own = numbers[question]?.[quantity];
          const value = own?.most ?? own?.value;
          return value == null ? "" : `${short(value)} ${own.unit}${numbers[question].exact ? "" : ", not exact"}`;
        });
        rows.push([`${told.words}, ${quantity}`, cells]);
      }
      rows.push([`${told.words}, along the path`, every.map(({ outcome }) => outcome[question] ?? "")]);
    }
    // What none has been asked has no row.
    const own = rows.filter(([, cells]) => cells.some(Boolean)).map(([name, cells]) => {
      const row = element("tr");
      row.append(element("th", { textContent: name }), ...cells.map((text) => element("td", { textContent: text || "–" })));
      return row;
    });
    this.body.replaceChildren(...own);
  }
}

function read(key) {
  try {
    return JSON.parse(localStorage.getItem(key));
  } catch {
    return null;
  }
}
