// Sets light or dark before the first paint. A classic script in <head>, because modules run too late for that.
(function () {
  var chosen = null;
  try {
    chosen = localStorage.getItem("apprentice-theme");
  } catch {
    chosen = null; // storage is off in some private windows: follow the system
  }
  var dark = chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = dark ? "dark" : "light";
})();
