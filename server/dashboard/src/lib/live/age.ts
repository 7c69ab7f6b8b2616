/**
 * The service's clocks, growing by this computer's since its last frame: how old a value is, and what time it is there.
 * This computer's own time of day may be minutes off.
 */

/** s after which a sample is stale: five control periods and a slow frame. */
export const STALE_AFTER = 0.5;

export class ServiceClock {
  private now = 0;
  private utc = 0;
  private heardAt: number | null = null;

  /** A frame that said `now` and `utc` (s) has arrived at `at` (s, this computer's monotonic clock). */
  heard(now: number, utc: number, at: number): void {
    this.now = now;
    this.utc = utc;
    this.heardAt = at;
  }

  /** Whether `now` is before what the last frame said, by more than `slack` s. */
  wentBack(now: number, slack: number): boolean {
    return this.heardAt !== null && now < this.now - slack;
  }

  /** The service's clock at `at`; null before the first frame. */
  at(at: number): number | null {
    return this.heardAt === null ? null : this.now + (at - this.heardAt);
  }

  /** Time of day at the service at `at`, in ms since 1970; null before the first frame. */
  wall(at: number): number | null {
    return this.heardAt === null ? null : (this.utc + (at - this.heardAt)) * 1000;
  }

  /** s since `hostTime`, at `at`; null before the first frame. */
  age(hostTime: number, at: number): number | null {
    const now = this.at(at);
    return now === null ? null : Math.max(0, now - hostTime);
  }

  /** s since a frame has arrived. */
  silence(at: number): number | null {
    return this.heardAt === null ? null : at - this.heardAt;
  }
}

/** How old what is shown is, as the end of a sentence; empty before anything was heard. Ages in s. */
export function lastHeard(silence: number | null, sampleAge: number | null): string {
  if (sampleAge !== null) return `the newest sample is ${ageText(sampleAge)} old`;
  return silence === null ? '' : `the service was last heard ${ageText(silence)} ago`;
}

/** An age as a person reads it: 20 ms, 3.4 s, 12 min. */
export function ageText(age: number | null): string {
  if (age === null) return 'never';
  if (age < 1) return `${Math.round(age * 1000)} ms`;
  if (age < 10) return `${age.toFixed(1)} s`;
  if (age < 120) return `${Math.round(age)} s`;
  if (age < 7200) return `${Math.round(age / 60)} min`;
  return `${Math.round(age / 3600)} h`;
}
