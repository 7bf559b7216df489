"use strict";
const large = document.getElementById("large");
for (const button of document.querySelectorAll("[data-large]")) {
  button.addEventListener("click", () => {
    large.lastElementChild.replaceChildren(button.firstElementChild.cloneNode(true));
    large.setAttribute("aria-label", button.getAttribute("aria-label").replace(/^Enlarge: /, ""));
    large.showModal();
  });
}
large.addEventListener("click", (event) => {
  if (event.target === large) large.close();
});
const unfold = () => {
  const section = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  const details = section && (section.querySelector(":scope > details") ?? section.closest("details"));
  if (details) details.open = true;
};
addEventListener("hashchange", unfold);
unfold();
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  for (const details of folded) details.open = true;
});
addEventListener("afterprint", () => {
  for (const details of folded) details.open = false;
});
