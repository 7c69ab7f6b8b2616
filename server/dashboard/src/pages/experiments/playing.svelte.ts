/** The moment of a previewed motion that is shown: chosen by hand, or running at the motion's own speed. */

export class Playing {
  moment = $state(0);
  isPlaying = $state(false);
  /** Whether somebody has chosen a moment: until then none is marked. */
  isUsed = $state(false);
  private frame = 0;

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
    const from = this.moment >= duration ? 0 : this.moment;
    const begun = performance.now();
    this.isPlaying = this.isUsed = true;
    const next = (now: number): void => {
      this.moment = Math.min(duration, from + Math.max(0, now - begun) / 1000);
      if (this.moment < duration) this.frame = requestAnimationFrame(next);
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
