/** When something dear may be drawn again, so that it leaves time for everything else. Times in s. Pure. */

export class FrameBudget {
  private next = 0;

  /**
   * `share`: of the time that drawing may take. `soonest`, `latest`: the shortest and the longest time from one
   * drawing to the next, whatever it costs.
   */
  constructor(
    private readonly share: number,
    private readonly soonest: number,
    private readonly latest: number,
  ) {}

  /** A drawing begins: the next has to wait until it is known what this one costs. */
  begun(): void {
    this.next = Infinity;
  }

  /** The drawing that began at `at` took `cost`. */
  spent(at: number, cost: number): void {
    const wait = Math.min(Math.max(cost / this.share, this.soonest), this.latest);
    this.next = at + Math.max(wait, cost);
  }

  /** s until the next drawing may begin; 0 when it may now, infinite while one is being drawn. */
  wait(at: number): number {
    return Math.max(0, this.next - at);
  }
}
