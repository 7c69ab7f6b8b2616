/** All arms of the service, looked at once a second while there are several. */

import { api, ask, here } from '../api/client';
import { asProblem, type Problem } from '../api/problem';
import type { FleetRobot } from '../api/types';
import { stop } from '../stop/stop.svelte';
import { armOf, cardOf, type Card } from './card';

const LOOK_EVERY = 1000;
const seconds = (): number => performance.now() / 1000;

class Fleet {
  robots = $state.raw<readonly FleetRobot[]>([]);
  problem = $state.raw<Problem | null>(null);
  private at = $state(0);
  private now = $state(0);
  cards: readonly Card[] = $derived(this.robots.map((robot) => cardOf(robot, this.now - this.at)));
  /** How many arms somebody should look at. */
  troubled: number = $derived(
    this.cards.filter((card) => card.tone === 'bad' || card.tone === 'warn').length,
  );
  private busy = false;
  private isStarted = false;

  start(): void {
    if (this.isStarted) return;
    this.isStarted = true;
    void this.look();
    setInterval(() => void this.look(), LOOK_EVERY);
    setInterval(() => (this.now = seconds()), 250);
  }

  /** One question at a time: a service that is slow is not asked more. */
  async look(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    const asked = seconds();
    try {
      this.robots = (await ask(api.GET('/api/v1/fleet'))).robots;
      // What the service said may be as old as the question.
      [this.at, this.now] = [asked, seconds()];
      this.problem = null;
      // The live socket follows the stop of the arm that is shown.
      if (stop.target === here().robot) return;
      const meant = this.robots.filter((robot) => stop.isOfAll || robot.robot === stop.target);
      stop.heard(armOf(meant), this.now);
    } catch (error) {
      this.problem = asProblem(error);
    } finally {
      this.busy = false;
    }
  }
}

export const fleet = new Fleet();
