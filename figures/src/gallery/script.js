"use strict";
// On narrow screens texts and all pictures but the first are folded.
if (matchMedia("(max-width: 44rem)").matches) for (const part of document.querySelectorAll("details.wide")) part.open = false;
addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details.wide")) part.open = true; });

// The lecture: #lecture or #lecture-3 shows one slide; arrows, space and Escape go on.
const lecture = document.getElementById("lecture");
if (lecture) {
  const slides = [...lecture.querySelectorAll("article")];
  const shown = () => {
    const match = /^#lecture(?:-(\d+))?$/.exec(location.hash);
    return match ? Math.min(Math.max(Number(match[1] || 1), 1), slides.length) : 0;
  };
  const show = () => {
    const slide = shown();
    lecture.hidden = !slide;
    document.body.style.overflow = slide ? "hidden" : "";
    slides.forEach((article, i) => {
      article.hidden = i + 1 != slide;
      // The next slide's picture is there before it is asked for.
      if (slide && Math.abs(i + 1 - slide) < 2) article.querySelector("img").loading = "eager";
    });
    lecture.querySelector("[data-count]").textContent = slide + " of " + slides.length;
  };
  const go = by => {
    const slide = by ? Math.min(Math.max(shown() + by, 1), slides.length) : 0;
    history.replaceState(null, "", slide ? "#lecture-" + slide : location.pathname + location.search);
    show();
  };
  for (const link of lecture.querySelectorAll("[data-go]"))
    link.addEventListener("click", event => { event.preventDefault(); go(Number(link.dataset.go)); });
  addEventListener("keydown", event => {
    if (!shown()) return;
    const by = { ArrowRight: 1, ArrowDown: 1, PageDown: 1, " ": 1, ArrowLeft: -1, ArrowUp: -1, PageUp: -1, Escape: 0 }[event.key];
    if (by !== undefined) { event.preventDefault(); go(by); }
  });
  addEventListener("hashchange", show);
  show();
}
