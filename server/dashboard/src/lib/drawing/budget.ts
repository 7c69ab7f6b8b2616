/** When something dear may be drawn again, so that it leaves time for everything else. Times in s. Pure. */

/** What was drawn within this time counts for the rate. */
const LATELY = 2;

export class FrameBudget {
  private next = 0;
  private drawn: number[] = [];

  /**
   * `share`: of the time that drawing may take. `soonest`, `latest`: the shortest and the longest time from one
   * drawing to the next, whatever it costs.
   */
  constructor(
    private readonly share: number,
    private readonly soonest: number,
    private readonly latest: number,
  ) {}

  /** A drawing begins at `at`: the next has to wait until it is known what this one costs. */
  begun(at: number): void {
    this.next = Infinity;
    this.drawn = [...this.drawn.filter((one) => one > at - LATELY), at];
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

  /** Drawings a second, lately. */
  rate(at: number): number {
    return this.drawn.filter((one) => one > at - LATELY).length / LATELY;
  }
}
