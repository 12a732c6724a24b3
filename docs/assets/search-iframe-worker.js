// The search of the site: its index, heavier than a page, is fetched when somebody is about to search; and it works where
// the site is opened from files, where browsers start no workers: the worker's script then runs in a frame.
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
    if (this.isIndex) isWanted.then(() => send.call(this, body));
    else send.call(this, body);
  };
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
