// What has been done, state by state. A state is the text of the file and what sliders have changed of it, so that comments come
// back with it. What is not saved is kept in the browser under the name of the file and of the page, for a page that was closed: two
// pages of one file keep theirs beside each other.

const KEY = "jointplay.unsaved ";
/** A page holds a lock of its name as long as it is open. */
const LOCK = "jointplay.page ";
const PAGE = `${Date.now().toString(36)}${Math.random().toString(36).slice(2)}`;
// How often, and after how many milliseconds, it is asked again whether a page is open: the one before this in a window ends late.
const ASKED = 4, BETWEEN = 100;

navigator.locks?.request(LOCK + PAGE, () => new Promise(() => {}));

const keyOf = (name, page = PAGE) => `${KEY}${name} ${page}`;

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
    this.lose();
    this.name = name;
    this.saved = state;
    this.keep();
  }

  /** Gives up what this page has kept. */
  lose() {
    forget(keyOf(this.name));
  }

  keep() {
    if (this.isSaved) this.lose();
    else put(keyOf(this.name), { ...this.now, picture: undefined, when: Date.now() });
    this.changed();
  }
}

function put(key, state) {
  try {
    localStorage.setItem(key, JSON.stringify(state));
  } catch {
    // Where the browser keeps nothing, the question before a page is closed is left.
  }
}

/** The pages that are open. */
async function pages() {
  const { held = [] } = (await navigator.locks?.query()) ?? {};
  return held.filter(({ name }) => name.startsWith(LOCK)).map(({ name }) => name.slice(LOCK.length));
}

/** What pages of a file that are closed have not saved, the newest first, each with its key. */
export async function unsaved(name) {
  for (let asked = 1; ; asked++) {
    const found = keptOf(name);
    const open = found.length ? await pages() : [];
    const closed = found.filter(({ page }) => !open.includes(page));
    if (closed.length === found.length || asked === ASKED) return closed.sort((a, b) => b.when - a.when);
    await new Promise((resolve) => setTimeout(resolve, BETWEEN));
  }
}

function keptOf(name) {
  const begins = keyOf(name, "");
  const read = (key) => {
    try {
      return { ...JSON.parse(localStorage.getItem(key)), key, page: key.slice(begins.length) };
    } catch {
      return {};
    }
  };
  try {
    const found = Object.keys(localStorage).filter((key) => key.startsWith(begins)).map(read);
    // The name of another file may begin with this one.
    return found.filter(({ page, text }) => text !== undefined && page !== PAGE && !page.includes(" "));
  } catch {
    return [];
  }
}

export function forget(key) {
  try {
    localStorage.removeItem(key);
  } catch {
    // Nothing is kept there.
  }
}
