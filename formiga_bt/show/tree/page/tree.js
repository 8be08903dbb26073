"use strict";
// The page reads well without this: it adds search, keys, and the line of the step that is chosen.
document.documentElement.classList.add("js");
const tree = document.getElementById("tree");
const find = document.getElementById("find");
const count = document.getElementById("count");
const items = [...tree.querySelectorAll("li")];
const folds = [...tree.querySelectorAll("details")];
const row = (item) => item.querySelector(":scope > .row, :scope > details > .row");
let wasOpen = null;

function search() {
  const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
  items.forEach((item) => item.classList.remove("gone", "hit"));
  count.textContent = "";
  if (!words.length) {
    if (wasOpen) folds.forEach((fold, at) => { fold.open = wasOpen[at]; });
    wasOpen = null;
    return;
  }
  wasOpen = wasOpen || folds.map((fold) => fold.open);
  const hits = items.filter((item) => {
    const text = row(item).textContent.toLowerCase();
    return words.every((word) => text.includes(word));
  });
  const shown = new Set();
  for (const hit of hits) {
    hit.classList.add("hit");
    hit.querySelectorAll("li").forEach((item) => shown.add(item));
    for (let at = hit; at && at !== tree; at = at.parentElement) {
      if (at.tagName === "LI") shown.add(at);
      if (at.tagName === "DETAILS" && at.parentElement !== hit) at.open = true;
    }
  }
  items.forEach((item) => item.classList.toggle("gone", !shown.has(item)));
  count.textContent = hits.length + " of " + items.length;
}

function choose(one) {
  const link = one.querySelector("a");
  const line = link && document.getElementById(link.hash.slice(1));
  if (!line) return;
  document.querySelectorAll("pre .at").forEach((old) => old.classList.remove("at"));
  line.classList.add("at");
  const pane = document.getElementById("source");
  if (pane.scrollHeight > pane.clientHeight) {
    pane.scrollTop += line.getBoundingClientRect().top - pane.getBoundingClientRect().top - pane.clientHeight / 3;
  }
}

function visible() {
  return [...tree.querySelectorAll(".row")].filter((one) => one.offsetParent !== null);
}

tree.querySelectorAll("li .row").forEach((one) => {
  if (one.tagName !== "SUMMARY") one.tabIndex = 0;
  one.addEventListener("focus", () => choose(one));
});
tree.addEventListener("click", (event) => {
  const one = event.target.closest(".row");
  if (!one) return;
  choose(one);
  if (event.target.closest("a")) event.preventDefault();
});
find.addEventListener("input", search);
document.getElementById("open").addEventListener("click", () => folds.forEach((fold) => { fold.open = true; }));
document.getElementById("close").addEventListener("click", () => folds.forEach((fold) => { fold.open = false; }));
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});
addEventListener("beforeprint", () => folds.forEach((fold) => { fold.open = true; }));
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "/" && document.activeElement !== find) { find.focus(); event.preventDefault(); return; }
  if (document.activeElement === find) {
    if (event.key === "Escape") { find.value = ""; search(); find.blur(); }
    if (event.key === "Enter" || event.key === "ArrowDown") {
      const hit = visible().find((one) => one.closest("li.hit") && row(one.closest("li")) === one);
      if (hit) { hit.focus(); event.preventDefault(); }
    }
    return;
  }
  const one = document.activeElement && document.activeElement.closest("#tree .row");
  if (!one) return;
  const rows = visible().filter((other) => other.tabIndex >= 0);
  const at = rows.indexOf(one);
  const fold = one.parentElement.tagName === "DETAILS" ? one.parentElement : null;
  let next = null;
  if (event.key === "ArrowDown") next = rows[at + 1];
  else if (event.key === "ArrowUp") next = rows[at - 1];
  else if (event.key === "ArrowRight" && fold && !fold.open) fold.open = true;
  else if (event.key === "ArrowRight") next = fold ? rows[at + 1] : null;
  else if (event.key === "ArrowLeft" && fold && fold.open) fold.open = false;
  else if (event.key === "ArrowLeft") next = one.closest("ul").parentElement.querySelector(":scope > .row");
  else return;
  event.preventDefault();
  if (next) next.focus();
});
