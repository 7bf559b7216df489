"use strict";
for (const player of document.querySelectorAll("[data-player]")) {
  const controls = player.querySelector(".controls");
  const [button, slider, clock] = controls.children;
  const instants = JSON.parse(clock.dataset.instants);
  const walkers = [...player.querySelectorAll("[data-frames]")].map((group) => ({
    frames: JSON.parse(group.dataset.frames),
    legs: group.querySelectorAll(".leg"),
    hip: group.querySelector(".hip"),
    group,
  }));
  let startedAt = null;

  const show = (index) => {
    for (const { frames, legs, hip } of walkers) {
      const [x0, y0, x1, y1, x2, y2] = frames[Math.min(index, frames.length - 1)];
      legs[0].setAttribute("points", `${x0},${-y0} ${x1},${-y1}`);
      legs[1].setAttribute("points", `${x2},${-y2} ${x1},${-y1}`);
      hip.setAttribute("cx", x1);
      hip.setAttribute("cy", -y1);
    }
    slider.value = index;
    clock.textContent = `${instants[index].toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  };
  const stop = () => {
    startedAt = null;
    button.textContent = "Play";
  };
  const tick = (now) => {
    if (startedAt === null) return;
    const time = (now - startedAt) / 1000;
    const next = instants.findIndex((instant) => instant >= time);
    show(next < 0 ? instants.length - 1 : next);
    if (next < 0) stop();
    else requestAnimationFrame(tick);
  };
  button.addEventListener("click", () => {
    if (startedAt !== null) return stop();
    const from = Number(slider.value) >= instants.length - 1 ? 0 : instants[slider.value];
    startedAt = performance.now() - 1000 * from;
    button.textContent = "Pause";
    requestAnimationFrame(tick);
  });
  slider.addEventListener("input", () => {
    stop();
    show(Number(slider.value));
  });
  for (const { group } of walkers) group.removeAttribute("hidden");
  controls.hidden = false;
  player.classList.add("live");
  show(0);
}
