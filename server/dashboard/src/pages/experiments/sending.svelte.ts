/** When an experiment is to be run, and handing it to the service: once, however often the button is pressed. */

import { ZONE } from '../../lib/format';
import { live } from '../../lib/live/live.svelte';
import { asProblem, newKey, type Experiment, type ExperimentSpec, type Problem } from '../../lib/api';
import { addSchedule, addToQueue, toldQueued, toldScheduled } from '../../lib/queue/submit';
import { typedNumber, type NumberRule } from '../../lib/trajectory/numbers';
import { cronOf, localMoment, momentOf, UNITS, type Unit } from '../../lib/trajectory/when';

export type When = 'now' | 'at' | 'daily' | 'every';

const whole = (low: number, high: number): NumberRule => ({
  bounds: { low, high, above: false },
  unit: '',
  scale: 1,
  integer: true,
});
const PRIORITY = whole(-100, 100);
const COUNT = whole(1, 1_000_000);
const SHORTEST = 10;
const LONGEST = 366 * UNITS.d;

export class Sending {
  when = $state<When>('now');
  /** Value of a `datetime-local` field. */
  at = $state(localMoment(new Date(Date.now() + 10 * 60_000)));
  /** The same for the first run of a schedule; empty for at once. */
  starts = $state('');
  /** Time of day, by this browser's clock. */
  daily = $state('02:00');
  /** Weekdays by cron's numbers: none, until they are chosen. */
  days = $state<number[]>([]);
  every = $state('30');
  unit = $state<Unit>('min');
  count = $state('');
  priority = $state('0');
  busy = $state(false);
  problem = $state.raw<Problem | null>(null);
  /** What became of the last one. */
  done = $state('');
  /** The last one as it is in the queue; null for a schedule. */
  made = $state.raw<Experiment | null>(null);
  problems: Readonly<Record<string, string>> = $derived.by(() => this.wrong());
  private key = newKey();

  /** Whether it is to be run again and again. */
  get isSchedule(): boolean {
    return this.when === 'daily' || this.when === 'every';
  }

  /** Sends it. Whether it was taken; `problem` says why not. */
  async send(spec: ExperimentSpec): Promise<boolean> {
    if (this.busy) return false;
    this.busy = true;
    this.problem = null;
    this.done = '';
    this.made = null;
    try {
      this.done = this.isSchedule ? await this.schedule(spec) : await this.submit(spec);
      this.key = newKey();
      return true;
    } catch (error) {
      this.problem = asProblem(error);
      // Only a request without an answer is the same one when it is sent again.
      if (this.problem.status !== 0) this.key = newKey();
      return false;
    } finally {
      this.busy = false;
    }
  }

  private async submit(spec: ExperimentSpec): Promise<string> {
    const at = this.when === 'at' ? momentOf(this.at) : null;
    const more = { priority: Number(this.priority), ...(at === null ? {} : { at }) };
    this.made = await addToQueue(spec, this.key, more);
    return toldQueued(this.made);
  }

  private async schedule(spec: ExperimentSpec): Promise<string> {
    const count = this.count.trim() === '' ? null : Number(this.count);
    const when =
      this.when === 'daily'
        ? { cron: cronOf(this.daily, this.days), zone: ZONE }
        : { every: this.seconds(), starts: momentOf(this.starts) };
    const made = await addSchedule(spec, { ...when, count, priority: Number(this.priority) });
    return toldScheduled(made, live.wall);
  }

  private seconds(): number {
    return Number(this.every.replace(',', '.')) * UNITS[this.unit];
  }

  private wrong(): Record<string, string> {
    const problems: Record<string, string> = {};
    const { problem } = typedNumber(this.priority, PRIORITY);
    if (problem) problems.priority = problem;
    if (this.when === 'at' && momentOf(this.at) === null) problems.at = 'a day and a time are needed';
    if (this.when === 'daily' && this.daily === '') problems.daily = 'a time is needed';
    if (this.when === 'daily' && this.days.length === 0) problems.days = 'choose at least one day';
    if (this.isSchedule) {
      const every = this.seconds();
      if (this.when === 'every' && !(every >= SHORTEST && every <= LONGEST))
        problems.every = 'allowed: 10 s to 366 d';
      const count = this.count.trim() === '' ? '' : typedNumber(this.count, COUNT).problem;
      if (count) problems.count = count;
    }
    return problems;
  }
}
