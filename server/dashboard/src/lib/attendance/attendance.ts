/**
 * Says for an operator to be there while the page is used: a run on a real arm that must be attended ends a minute after
 * it was last said. Never by a timer alone: a page that is left open attends nothing.
 *
 * Knows nothing about a browser: what says so, and what tells the time, is handed in.
 */

/** s between two times that it is said, at least. */
export const SAY_EVERY = 20;
/** px that a pointer has to go: the arm may shake the table on which the mouse lies. */
export const HAND_MOVES = 20;

export interface AttendanceParts {
  /** Whether something runs that needs it, and the user may say so. */
  isNeeded(): boolean;
  say(): void;
  /** s, of a clock that only goes forward. */
  now(): number;
}

export class Attendance {
  private said = -Infinity;
  private place: readonly [x: number, y: number] | null = null;

  constructor(private readonly parts: AttendanceParts) {}

  /** A key or a button was pressed. */
  used(): void {
    const now = this.parts.now();
    if (now - this.said < SAY_EVERY || !this.parts.isNeeded()) return;
    this.said = now;
    this.parts.say();
  }

  /** The pointer is at this place of the screen; browsers tell so also when the page has moved below it. */
  pointed(x: number, y: number): void {
    if (this.place !== null && Math.hypot(x - this.place[0], y - this.place[1]) < HAND_MOVES) return;
    const isFirst = this.place === null;
    this.place = [x, y];
    if (!isFirst) this.used();
  }
}
