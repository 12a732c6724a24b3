// The machine driven to what is asked for, no faster than its drives may: a tick of the kernels at each picture.
const TICK = 0.02, LONGEST = 1, SLOWEST = 0.01;

class Driver {
  constructor(session) {
    const { actuators, length } = session.machine;
    const range = ({ low, high, isAngle }) => (low === null || high === null ? (isAngle ? Math.PI : length) : high - low);
    Object.assign(this, { session, clock: 0, share: 0, most: actuators.map((each) => each.speed ?? range(each)) });
    this.slower(0.75);
  }

  /** Let drives go at most a share of their speeds, which are their ranges in a second where the file has none. */
  slower(place) {
    this.share = SLOWEST ** (1 - place);
    this.speeds = this.most.map((speed) => this.share * speed);
  }

  /** Go towards what is asked for, from where the machine is. */
  follow(state) {
    const { session } = this;
    Object.assign(session, state, { hasJumped: false });
    session.onAsk?.();
    if (this.clock) return;
    let before = performance.now();
    const frame = (now) => {
      const passed = clamp((now - before) / 1000, 1e-3, LONGEST);
      before = now;
      this.clock = this.goOn(passed) ? requestAnimationFrame(frame) : 0;
    };
    this.clock = requestAnimationFrame(frame);
  }

  /** Some seconds on, in ticks; false where the machine rests, or is beyond its limits. */
  goOn(seconds) {
    const { session } = this, ticks = Math.ceil(seconds / TICK);
    const { engine, target, answer } = session;
    if (answer !== this.last && !engine.rest(answer)) return false;
    for (let n = 0; n < ticks; n++) this.last = engine.tick(target, seconds / ticks, this.speeds);
    session.start = this.last;
    session.settle({ answer: this.last });
    return this.last.isMoving;
  }

  stop() {
    cancelAnimationFrame(this.clock);
    this.clock = 0;
  }
}
