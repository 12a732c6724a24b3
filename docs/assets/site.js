// The theme has chosen light or dark.
setTimeout(() => (document.body.dataset.isSettled = true));

// Machines that are live in a page are light or dark as the page is, also where its switch was used.
const isDark = () => document.body.dataset.mdColorScheme === "slate";
const tell = (frame) => frame.contentWindow?.postMessage({ theme: isDark() ? "dark" : "light" }, "*");
const frames = () => document.querySelectorAll("iframe.live");
frames().forEach((frame) => frame.addEventListener("load", () => tell(frame)));
frames().forEach(tell);
new MutationObserver(() => frames().forEach(tell)).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
