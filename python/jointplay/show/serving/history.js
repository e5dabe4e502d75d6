// What has been done, state by state. A state is the text of the file and what sliders have changed of it, so that comments come
// back with it. What is not saved is kept in the browser under the name of the file, for a page that was closed.

const KEY = "jointplay.unsaved ";

const same = (a, b) => a.text === b.text && JSON.stringify(a.values) === JSON.stringify(b.values);

export class History {
  /** Begins with a state; `changed` is called whenever it is another one. */
  constructor(name, state, changed) {
    Object.assign(this, { name, now: state, saved: state, past: [], future: [], changed });
  }

  get isSaved() {
    return same(this.now, this.saved);
  }

  /** A new state after a gesture; nothing where it is the same. */
  push(next) {
    const state = { picture: this.now.picture, ...next };
    if (same(state, this.now) && state.picture === this.now.picture && JSON.stringify(state.offsets) === JSON.stringify(this.now.offsets)) return;
    this.past.push(this.now);
    this.now = state;
    this.future = [];
    this.keep();
  }

  /** The state before or after; null where there is none. */
  step(back) {
    const [from, to] = back ? [this.past, this.future] : [this.future, this.past];
    if (!from.length) return null;
    to.push(this.now);
    this.now = from.pop();
    this.keep();
    return this.now;
  }

  /** What is shown now stands in the file. */
  save(name, state) {
    forget(this.name);
    this.name = name;
    this.saved = state;
    this.keep();
  }

  keep() {
    if (this.isSaved) forget(this.name);
    else put(this.name, { ...this.now, picture: undefined, when: Date.now() });
    this.changed();
  }
}

function put(name, state) {
  try {
    localStorage.setItem(KEY + name, JSON.stringify(state));
  } catch {
    // Where the browser keeps nothing, the question before a page is closed is left.
  }
}

/** What was not saved of a file when its page was closed; null where there is nothing. */
export function unsaved(name) {
  try {
    return JSON.parse(localStorage.getItem(KEY + name));
  } catch {
    return null;
  }
}

export function forget(name) {
  try {
    localStorage.removeItem(KEY + name);
  } catch {
    // Nothing is kept there.
  }
}
