// The time that everything in a replay shows.

type Listener = () => void;

export class Clock {
  private at = 0; // s
  private running = false;
  private before = 0;
  private readonly listeners: Listener[] = [];
  speed = 1;

  constructor(
    readonly length: number, // s
    readonly frame: number, // s from one stored state to the next
  ) {}

  get time(): number {
    return this.at;
  }

  get playing(): boolean {
    return this.running;
  }

  subscribe(listener: Listener): void {
    this.listeners.push(listener);
  }

  seek(time: number): void {
    this.at = Math.min(Math.max(time, 0), this.length);
    this.changed();
  }

  // To a stored state, `count` of them on or back.
  step(count: number): void {
    this.pause();
    const place = this.at / this.frame;
    const nearest = Math.round(place);
    const from = Math.abs(place - nearest) < 1e-6 ? nearest : count > 0 ? Math.floor(place) : Math.ceil(place);
    this.seek((from + count) * this.frame);
  }

  toggle(): void {
    if (this.running) this.pause();
    else this.play();
  }

  play(): void {
    if (this.running) return;
    if (this.at >= this.length) this.at = 0;
    this.running = true;
    this.before = performance.now();
    const tick = (now: number) => {
      if (!this.running) return;
      // Where drawing is slow, states are left out and the time stays true; a tab that was away goes on where it was.
      const passed = Math.min(Math.max(0, now - this.before), 250);
      this.before = now;
      this.at = Math.min(this.length, this.at + (passed / 1000) * this.speed);
      if (this.at >= this.length) this.running = false;
      this.changed();
      if (this.running) requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    this.changed();
  }

  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.changed();
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}
