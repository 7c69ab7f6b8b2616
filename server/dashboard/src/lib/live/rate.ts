/**
 * How many samples a second there are, and whether the service leaves some out for this page. Times in s, of the clock
 * that the samples were taken by: those that waited for this page and arrive all at once are not more for it. Pure.
 */

/** What was sampled within this time counts for the rate. */
const OVER = 3;
/** s from the first sample until there is a rate. */
const FIRST = 0.5;
/** s after the newest sample from which their absence counts. */
const PAUSE = 0.5;
/** s for which it is said that samples were left out. */
const SAID_FOR = 10;

export class SampleRate {
  private times: number[] = [];
  private thinnedAt = -Infinity;

  /** A sample has arrived that was taken at `time`. */
  heard(time: number): void {
    // After a pause, and after a clock that began anew, what comes is another stretch: neither counts.
    const last = this.times.at(-1) ?? time;
    if (time < last || time - last > OVER) this.times = [];
    this.times.push(time);
  }

  /** The service has left out samples because this page did not take them in time. `at`: of any clock of one's own. */
  thinned(at: number): void {
    this.thinnedAt = at;
  }

  isThinned(at: number): boolean {
    return at - this.thinnedAt < SAID_FOR;
  }

  /** Hz, at `now` of the samples' clock; null while nothing comes, or too little has come. */
  rate(now: number): number | null {
    this.times = this.times.filter((time) => time > now - OVER);
    const [first, last] = [this.times[0], this.times.at(-1)];
    if (first === undefined || last === undefined) return null;
    const over = (now - last > PAUSE ? now : last) - first;
    return over < FIRST ? null : (this.times.length - 1) / over;
  }
}

/** For the badge in the header. */
export function rateText(rate: number | null, isThinned: boolean): string {
  if (rate === null) return 'live';
  return `live ${Math.round(rate)} Hz${isThinned ? ', thinned' : ''}`;
}
