// Questions to the program that serves the page: its answers come one after the other, as lines of JSON.
async function* answersTo(question, asked, signal) {
  const response = await fetch(question, { method: "POST", body: JSON.stringify(asked), signal });
  if (!response.ok) throw Error(`${question}: ${response.status}`);
  const [reader, decoder] = [response.body.getReader(), new TextDecoder()];
  for (let text = ""; ; ) {
    const { value, done } = await reader.read();
    text += decoder.decode(value, { stream: !done });
    const lines = text.split("\n");
    text = lines.pop();
    for (const line of lines) yield JSON.parse(line);
    if (done) return;
  }
}

/** One question at a time; whatever waits behind the newest is out of date. */
class Newest {
  constructor(question, onError) {
    Object.assign(this, { question, onError, isBusy: false, waiting: null, count: 0 });
  }

  /** Ask what `make` returns when its turn comes; its answers go to `done`, and if it still is the newest. */
  ask(make, done = () => {}) {
    this.waiting = { make, done, number: ++this.count };
    if (!this.isBusy) this.run();
  }

  drop() {
    this.waiting = null;
    this.count++;
  }

  async run() {
    this.isBusy = true;
    while (this.waiting) {
      const { make, done, number } = this.waiting;
      this.waiting = null;
      try {
        for await (const answer of answersTo(this.question, make()))
          if (answer.error) this.onError(answer.error);
          else if (number === this.count || this.waiting) done(answer, number === this.count);
      } catch (error) {
        this.onError(String(error.message ?? error));
      }
    }
    this.isBusy = false;
  }
}

/** Answers of Python, for machines that the kernels in a page cannot answer for. */
class RemoteEngine extends StillEngine {
  constructor(machine) {
    super(machine);
    this.isStill = false;
    this.isRemote = true;
    this.newest = new Newest("ask", (error) => window.page?.live?.say(error, true));
  }

  question(make, done) {
    this.newest.ask(() => ({ ...make(), free: this.machine.live.free }), (answer, isLast) => done(received(answer), isLast));
  }
}
