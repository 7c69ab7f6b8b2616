/** How many samples a second really arrive, and whether the service leaves some out for this page. Times in s. Pure. */

/** What arrived within this time counts for the rate. */
const OVER = 3;
/** s from the first sample until there is a rate. */
const FIRST = 0.5;
/** s for which it is said that samples were left out. */
const SAID_FOR = 10;

export class ReceivedRate {
  private times: number[] = [];
  private begun: number | null = null;
  private thinnedAt = -Infinity;

  /** A sample has arrived. */
  heard(at: number): void {
    this.begun ??= at;
    this.times.push(at);
  }

  /** The service has left out samples because this page did not take them in time. */
  thinned(at: number): void {
    this.thinnedAt = at;
  }

  isThinned(at: number): boolean {
    return at - this.thinnedAt < SAID_FOR;
  }

  /** Hz; null while nothing comes, or too little has come. */
  rate(at: number): number | null {
    const old = this.times.findIndex((time) => time > at - OVER);
    this.times = old < 0 ? [] : this.times.slice(old);
    if (this.begun === null || this.times.length === 0) {
      this.begun = null; // what comes next is another stretch: the pause does not count
      return null;
    }
    const over = Math.min(OVER, at - this.begun);
    return over < FIRST ? null : this.times.length / over;
  }
}

/** For the badge in the header. */
export function rateText(rate: number | null, isThinned: boolean): string {
  if (rate === null) return 'live';
  return `live ${Math.round(rate)} Hz${isThinned ? ', thinned' : ''}`;
}
