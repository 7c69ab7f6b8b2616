/** What waits, what runs, what has ended, and what is scheduled: asked for again whenever the service says it changed. */

import { api, ask, asProblem, here, type Experiment, type Problem, type Schedule } from '../../lib/api';
import { live } from '../../lib/live/live.svelte';
import { afterSeconds, Reload } from '../../lib/reload/reload';
import { reordered } from '../../lib/trajectory/order';

/** Topics after which the lists may have changed. */
const TOPICS = new Set(['queue', 'event', 'robot']);
/** s in which several changes are taken together. */
const TOGETHER = 0.15;
const ENDED_SHOWN = 12;
const QUEUE = '/api/v1/robots/{robot}/queue';
const ALL = '/api/v1/robots/{robot}/experiments';
const ONE = '/api/v1/robots/{robot}/experiments/{experiment}';
const EXPERIMENT = `${ONE}/approval` as const;
const PLANNED = '/api/v1/robots/{robot}/schedules/{schedule}';
const SCHEDULE = `${PLANNED}/approval` as const;

export class QueueLists {
  waiting = $state.raw<readonly Experiment[]>([]);
  running = $state.raw<Experiment | null>(null);
  ended = $state.raw<readonly Experiment[]>([]);
  schedules = $state.raw<readonly Schedule[]>([]);
  problem = $state.raw<Problem | null>(null);
  /** What could not be done: cancel, reorder, pause. */
  refused = $state.raw<Problem | null>(null);
  loaded = $state(false);
  busy = $state(false);
  /** How often they were asked for: an answer that comes after a newer one is left aside. */
  private asked = 0;
  private readonly reload = new Reload({ load: () => void this.load(), after: afterSeconds });

  /** Follows the service until the returned function is called. */
  follow(): () => void {
    void this.load();
    const end = live.onMessage((message) => {
      if (TOPICS.has(message.topic)) this.reload.soon(TOGETHER);
    });
    return () => {
      end();
      this.reload.leave();
    };
  }

  /** For an effect that follows how often the connection has come back. */
  afterHealing(times: number): void {
    this.reload.afterHealing(times);
  }

  async load(): Promise<void> {
    const turn = ++this.asked;
    const path = here();
    try {
      const [waiting, running, ended, schedules] = await Promise.all([
        ask(api.GET(`${QUEUE}/experiments`, { params: { path } })),
        ask(api.GET(ALL, { params: { path, query: { state: ['running'] } } })),
        ask(api.GET(ALL, { params: { path, query: { order: 'ended', limit: ENDED_SHOWN } } })),
        ask(api.GET('/api/v1/robots/{robot}/schedules', { params: { path } })),
      ]);
      if (turn !== this.asked) return;
      this.waiting = waiting;
      this.running = running.items[0] ?? null;
      this.ended = ended.items;
      this.schedules = schedules.items;
      this.problem = null;
    } catch (error) {
      if (turn !== this.asked) return;
      this.problem = asProblem(error);
    }
    this.loaded = true;
  }

  /** Whether what waits at one place can be moved to another: all priorities that this changes are the caller's to change. */
  mayMove(from: number, to: number): boolean {
    if (to < 0 || to >= this.waiting.length) return false;
    const owners = new Map(this.waiting.map((one) => [one.id, one.owner]));
    return reordered(this.waiting, from, to)?.every(({ id }) => live.mayChange(owners.get(id) ?? '')) ?? true;
  }

  /** Moves what waits at one place to another. */
  async move(from: number, to: number): Promise<void> {
    const changes = reordered(this.waiting, from, to);
    if (changes === null) {
      await this.change(() => Promise.reject(new Error('priorities end at 100: lower another one first')));
      return;
    }
    await this.change(async () => {
      for (const { id, priority } of changes) {
        const params = { path: { ...here(), experiment: id } };
        await ask(api.PATCH(ONE, { params, body: { priority } }));
      }
    });
  }

  async cancel(id: string): Promise<void> {
    const params = { path: { ...here(), experiment: id } };
    await this.change(() => ask(api.POST(`${ONE}/cancel`, { params })));
  }

  /** Approves exactly what is shown: the service refuses it if it has changed meanwhile. */
  async approve(one: Experiment | Schedule, isSchedule: boolean): Promise<void> {
    const params = { path: { ...here(), schedule: one.id, experiment: one.id } };
    const body = { content: one.content };
    await this.change(() => ask(api.PUT(isSchedule ? SCHEDULE : EXPERIMENT, { params, body })));
  }

  async withdrawApproval(one: Experiment | Schedule, isSchedule: boolean): Promise<void> {
    const params = { path: { ...here(), schedule: one.id, experiment: one.id } };
    await this.change(() => ask(api.DELETE(isSchedule ? SCHEDULE : EXPERIMENT, { params })));
  }

  async pause(): Promise<void> {
    await this.change(() => ask(api.POST(`${QUEUE}/pause`, { params: { path: here() } })));
  }

  /** `movesRealArm`: the operator's word that the workspace of a real arm is clear. */
  async resume(movesRealArm: boolean): Promise<void> {
    const body = { moves_real_arm: movesRealArm };
    await this.change(() => ask(api.POST(`${QUEUE}/resume`, { params: { path: here() }, body })));
  }

  async attend(): Promise<void> {
    await this.change(() => ask(api.POST(`${QUEUE}/attend`, { params: { path: here() } })));
  }

  async switchSchedule(schedule: string, active: boolean): Promise<void> {
    const params = { path: { ...here(), schedule } };
    await this.change(() => ask(api.PATCH(PLANNED, { params, body: { active } })));
  }

  async deleteSchedule(schedule: string): Promise<void> {
    const params = { path: { ...here(), schedule } };
    await this.change(() => ask(api.DELETE(PLANNED, { params })));
  }

  private async change(order: () => Promise<unknown>): Promise<void> {
    this.busy = true;
    this.refused = null;
    try {
      await order();
    } catch (error) {
      this.refused = asProblem(error);
    }
    await this.load();
    this.busy = false;
  }
}
