// A path that is played: its steps are answers that were found before.
class Player {
  static async open(page, track) {
    const steps = JSON.parse(new TextDecoder().decode(await unpacked(track.steps)));
    return new Player(page, track.every, steps.map(received));
  }

  constructor(page, every, steps) {
    Object.assign(this, { page, every, steps, place: 0 });
    const { length } = page.machine;
    const lineOf = (name) => steps.map((step) => scaled(originOf(step[name]), 1 / length));
    page.paths = [["target", "steel"], ["pose", "platform"]].map(([name, paint]) => {
      const line = lineOf(name);
      return { mesh: wires(line.slice(1).map((end, k) => [line[k], end]), 0.35 * page.scene.radius), paint };
    });
    this.slider = $("#player input");
    this.slider.max = steps.length - 1;
    this.slider.oninput = () => this.stop() ?? this.take(Number(this.slider.value));
    this.button = $("#player button");
    this.button.onclick = () => (this.clock ? this.stop() : this.play());
    $("#player").hidden = steps.length < 2;
    this.showStep();
  }

  take(place) {
    this.place = place;
    this.page.session.take(this.steps[place], this.steps[place].target, "path");
    this.showStep();
  }

  showStep() {
    this.slider.value = this.place;
    const seconds = this.steps[this.place].step * this.every;
    $("#player output").textContent = `${this.steps[this.place].step} · ${rounded(seconds, seconds < 10 ? 2 : 1)} s`;
  }

  /** Play it over and over, each step at its time. */
  play() {
    const began = performance.now() - (this.place === this.steps.length - 1 ? 0 : 1000 * this.every * this.place);
    const tick = () => {
      const place = Math.floor((performance.now() - began) / (1000 * this.every)) % this.steps.length;
      if (place !== this.place) this.take(place);
      this.clock = requestAnimationFrame(tick);
    };
    this.clock = requestAnimationFrame(tick);
    this.button.textContent = "❚❚";
    this.button.ariaLabel = "Stop";
  }

  stop() {
    cancelAnimationFrame(this.clock);
    this.clock = 0;
    this.button.textContent = "▶";
    this.button.ariaLabel = "Play";
  }
}

/** An answer as Python writes it: what is no number is null there. */
function received(answer) {
  return { ...answer, proximal: answer.proximal?.map((value) => value ?? NaN) ?? null };
}
