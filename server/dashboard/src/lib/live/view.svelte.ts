/** What the user has chosen to see on the Live page; kept in this browser. */

import type { AngleUnit } from './units';
import { WINDOWS } from './window';

const KEY = 'ma2000-live-view';

interface Kept {
  hidden: number[];
  seconds: number;
  angle: AngleUnit;
}

class View {
  /** Joints that are not drawn. */
  hidden = $state.raw<readonly number[]>([]);
  seconds = $state<number>(30);
  angle = $state<AngleUnit>('°');
  /** Whether the charts stand still, to be looked at. Not kept. */
  held = $state(false);

  constructor() {
    try {
      const kept = JSON.parse(localStorage.getItem(KEY) ?? '{}') as Partial<Kept>;
      if (Array.isArray(kept.hidden)) this.hidden = kept.hidden.filter(Number.isInteger);
      if (WINDOWS.some((one) => one === kept.seconds)) this.seconds = kept.seconds ?? 30;
      if (kept.angle === 'rad') this.angle = 'rad';
    } catch {
      localStorage.removeItem(KEY); // not written by this page: as if nothing had been chosen
    }
  }

  toggle(joint: number): void {
    this.hidden = this.hidden.includes(joint)
      ? this.hidden.filter((one) => one !== joint)
      : [...this.hidden, joint];
    this.keep();
  }

  choose(change: Partial<Pick<View, 'seconds' | 'angle'>>): void {
    Object.assign(this, change);
    this.keep();
  }

  private keep(): void {
    const kept: Kept = { hidden: [...this.hidden], seconds: this.seconds, angle: this.angle };
    localStorage.setItem(KEY, JSON.stringify(kept));
  }
}

export const view = new View();
