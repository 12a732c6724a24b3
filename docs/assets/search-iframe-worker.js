// The search of the site: its index, heavier than a page, is fetched when somebody is about to search; and it works where
// the site is opened from files, where browsers start no workers: the worker's script then runs in a frame.
let isThere = false;
{
  const isWanted = new Promise((search) => {
    if (/[?&]q=/.test(location.search)) search();
    addEventListener("keydown", search, { once: true });
    for (const name of ["pointerover", "pointerdown", "focusin"])
      addEventListener(name, ({ target }) => target.closest?.("[class*=search], [for=__search]") && search());
  });
  const { open, send } = XMLHttpRequest.prototype;
  XMLHttpRequest.prototype.open = function (method, url, ...more) {
    this.isIndex = String(url).endsWith("search.json");
    return open.call(this, method, url, ...more);
  };
  XMLHttpRequest.prototype.send = function (body) {
    this.addEventListener("load", () => (isThere ||= this.isIndex));
    if (this.isIndex) isWanted.then(() => send.call(this, body));
    else send.call(this, body);
  };
}

// The search opens when its index is there: letters that somebody types meanwhile are kept for it.
{
  const PATIENCE = 20_000, SOON = 30; // milliseconds
  let letters = "", waiting = 0, until = 0;
  const field = () => document.activeElement?.shadowRoot?.activeElement?.closest("input");
  const stop = () => (waiting = clearInterval(waiting));
  const hand = () => {
    const input = field();
    if (!input && performance.now() < until) return;
    stop();
    if (!input || !letters) return;
    input.value = letters + input.value;
    input.dispatchEvent(new InputEvent("input", { bubbles: true, composed: true }));
  };
  const wait = () => {
    if (field() || waiting) return;
    letters = "";
    until = performance.now() + PATIENCE;
    waiting = setInterval(hand, SOON);
  };
  const keep = (event) => {
    const { key } = event;
    const isCommand = event.ctrlKey || event.metaKey || event.altKey;
    const button = document.querySelector("[data-md-component=search] button");
    if (isCommand && key === "k" && !waiting && !isThere) button?.click();
    else if (key === "Escape") return stop();
    else if (!waiting || isCommand || field() || (key.length > 1 && key !== "Backspace")) return;
    else letters = key === "Backspace" ? letters.slice(0, -1) : letters + key;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  addEventListener("keydown", keep, true);
  addEventListener("click", ({ target }) => target.closest?.("[class*=search], [for=__search]") && wait());
}

class FrameWorker {
  constructor(url) {
    const frame = document.createElement("iframe");
    frame.hidden = true;
    document.body.append(frame);
    const inside = frame.contentWindow;
    const message = (data) => new MessageEvent("message", { data: structuredClone(data) });
    inside.postMessage = (data) => setTimeout(() => this.onmessage?.(message(data)));
    const script = inside.document.createElement("script");
    const isReady = new Promise((ready) => (script.onload = ready));
    script.src = url;
    inside.document.body.append(script);
    this.postMessage = (data) => isReady.then(() => setTimeout(() => inside.dispatchEvent(message(data))));
    this.terminate = () => frame.remove();
  }
}
if (location.protocol === "file:") window.Worker = FrameWorker;
