"use strict";
// A click on a heading sorts by its column; what has no key stays last, either way round.
for (const table of document.querySelectorAll("table.sorts")) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => heading.firstElementChild.addEventListener("click", () => {
    const down = heading.ariaSort === "ascending";
    const key = (row) => row.cells[column].dataset.key;
    const compare = (a, b) => {
      const [one, other] = [key(a), key(b)];
      if (one === "" || other === "") return (one === "") - (other === "");
      const order = column === 1 ? one.localeCompare(other) : Number(one) - Number(other);
      return down ? -order : order;
    };
    table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
    headings.forEach((each) => each.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
  }));
}
// A track's forces and spectra are those of the policies that are ticked; without this script, of all.
for (const track of document.querySelectorAll(".track")) {
  for (const box of track.querySelectorAll("input[data-policy]")) {
    const drawn = track.querySelectorAll(`polyline[data-policy="${box.dataset.policy}"]`);
    const show = () => drawn.forEach((each) => each.classList.toggle("off", !box.checked));
    box.addEventListener("change", show);
    show();
  }
}
