// What a tile says, beside the pointer at once; and a press that shows a dense figure at its full size.
const tip = document.createElement("div");
tip.id = "tip";
tip.hidden = true;
document.body.append(tip);
const place = (x, y) => {
  const box = tip.getBoundingClientRect();
  tip.style.left = `${Math.max(4, Math.min(x + 14, innerWidth - box.width - 4))}px`;
  tip.style.top = `${y + 18 + box.height > innerHeight ? y - box.height - 10 : y + 18}px`;
};
const say = (tile, x, y) => {
  const title = tile.querySelector("title");
  // The browser would say it again, later and in small print.
  if (title) {
    tile.setAttribute("aria-label", title.textContent);
    title.remove();
  }
  tip.textContent = tile.getAttribute("aria-label");
  tip.hidden = false;
  place(x, y);
};
document.addEventListener("pointerover", (event) => {
  const tile = event.target.closest?.(".hot path");
  if (tile) say(tile, event.clientX, event.clientY);
  else tip.hidden = true;
});
document.addEventListener("pointermove", (event) => tip.hidden || place(event.clientX, event.clientY));
document.addEventListener("focusin", (event) => {
  const tile = event.target.closest?.(".hot a")?.querySelector("path");
  tip.hidden = true;
  if (!tile) return;
  const box = tile.getBoundingClientRect();
  say(tile, box.right, box.bottom);
});
document.querySelectorAll("button.zoom").forEach((button) => {
  button.hidden = false;
  button.addEventListener("click", () => {
    const zoomed = button.closest("figure").querySelector(".embedded").classList.toggle("zoomed");
    button.textContent = zoomed ? "fit to the page" : "full size";
  });
});
