/**
 * Teaching: a program is put together from postures and led paths, kept by the service, and run. What asks the service is
 * handed in.
 */

import { asProblem, type Problem } from '../api/problem';
import type { Machine, TeachingStatus } from '../api/types';
import { ledAtFirst } from './lead';
import { KeptPrograms, type ProgramRequests } from './kept.svelte';
import { moved, play, type Instruction, type Program } from './program';

export interface TeachRequests extends ProgramRequests {
  run(program: Program): Promise<TeachingStatus>;
  lead(joints: readonly number[]): Promise<TeachingStatus>;
  /** Ends leading: the path is in the answer. */
  finish(): Promise<TeachingStatus>;
}

export class Teaching {
  readonly programs: KeptPrograms;
  /** Joints that are led next. */
  chosen = $state.raw<readonly number[]>([]);
  /** Joints that this page has begun to lead; none where somebody else has. */
  led = $state.raw<readonly number[]>([]);
  /** Whether the end of leading has been asked for: the arm has to come to rest first. */
  isEnding = $state(false);
  problem = $state.raw<Problem | null>(null);

  constructor(
    machine: Machine,
    private readonly requests: TeachRequests,
  ) {
    this.programs = new KeptPrograms(machine.name, requests);
    this.chosen = ledAtFirst(machine);
  }

  get instructions(): readonly Instruction[] {
    return this.programs.instructions;
  }

  keep(instruction: Instruction): void {
    void this.programs.change([...this.instructions, instruction]);
  }

  move(place: number, step: -1 | 1): void {
    void this.programs.change(moved(this.instructions, place, step));
  }

  /** The last one stays: a program has an instruction at least, and is deleted as a whole. */
  takeAway(place: number): void {
    if (this.instructions.length > 1)
      void this.programs.change(this.instructions.filter((_, other) => other !== place));
  }

  edit(place: number, instruction: Instruction): void {
    void this.programs.change(this.instructions.map((one, other) => (other === place ? instruction : one)));
  }

  choose(joint: number): void {
    const { chosen } = this;
    this.chosen = chosen.includes(joint)
      ? chosen.filter((one) => one !== joint)
      : [...chosen, joint].sort((one, other) => one - other);
  }

  async run(): Promise<void> {
    await this.tried(() => this.requests.run(this.programs.program()));
  }

  async lead(): Promise<void> {
    const joints = this.chosen;
    this.led = (await this.tried(() => this.requests.lead(joints))) === null ? [] : joints;
  }

  /** What the arm does is known to be another thing: whoever leads next may lead other joints. */
  isNotLed(): void {
    this.led = [];
  }

  /** Ends leading, and keeps its path as an instruction: once, however often it is asked for. */
  async finish(): Promise<void> {
    if (this.isEnding) return;
    this.isEnding = true;
    const status = await this.tried(() => this.requests.finish());
    this.isEnding = false;
    if (status === null) return;
    this.led = [];
    const path = status.path ?? null;
    if (path !== null) this.keep(play(path));
  }

  /** Null where the service refuses. */
  private async tried(order: () => Promise<TeachingStatus>): Promise<TeachingStatus | null> {
    try {
      const status = await order();
      this.problem = null;
      return status;
    } catch (error) {
      this.problem = asProblem(error);
      return null;
    }
  }
}
