/** The moment of a motion that is shown: chosen by hand, or running, at the motion's own speed or another one. */

export class Playing {
  moment = $state(0);
  isPlaying = $state(false);
  /** Whether somebody has chosen a moment: until then none is marked. */
  isUsed = $state(false);
  private frame = 0;

  /** `speed`: seconds of the motion in a second. `again`: whether it begins anew at its end, at `first` (s). */
  constructor(
    private readonly speed = 1,
    private readonly again = false,
    private readonly first = 0,
  ) {}

  goTo(moment: number): void {
    this.hold();
    this.isUsed = true;
    this.moment = moment;
  }

  /** Plays to the end, from the beginning when it is there; or holds. */
  toggle(duration: number): void {
    if (this.isPlaying) {
      this.hold();
      return;
    }
    const from = this.moment >= duration ? 0 : Math.max(this.first, this.moment);
    const begun = performance.now();
    this.isPlaying = this.isUsed = true;
    const next = (now: number): void => {
      const at = from + (this.speed * Math.max(0, now - begun)) / 1000;
      const { first } = this;
      this.moment = this.again
        ? first + ((at - first) % Math.max(1e-9, duration - first))
        : Math.min(duration, at);
      if (this.again || this.moment < duration) this.frame = requestAnimationFrame(next);
      else this.isPlaying = false;
    };
    this.frame = requestAnimationFrame(next);
  }

  reset(): void {
    this.hold();
    this.moment = 0;
    this.isUsed = false;
  }

  private hold(): void {
    cancelAnimationFrame(this.frame);
    this.isPlaying = false;
  }
}
