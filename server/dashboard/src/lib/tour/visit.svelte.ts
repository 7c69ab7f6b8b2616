/** Whether the tour is shown: invited by the address (`#/live?tour`), or at the first start. */

import { live } from '../live/live.svelte';
import { router } from '../router.svelte';
import { isWelcome } from './tour';

const KEY = 'ma2000-tour';

class TourVisit {
  isShown = $state(false);
  /** Whether a known robot was looked at before: later on somebody may be at work. */
  private isDecided = false;

  /** For an effect: once shown it counts as seen, however soon it is left. */
  watch(): void {
    const { robot } = live;
    const isInvited = router.route.query.has('tour');
    if (robot?.identity == null) return;
    const isMock = robot.identity.simulated;
    const isBusy = robot.arm === 'stopped' || robot.arm === 'fault' || robot.activity !== 'none';
    const wasSeen = this.isDecided || localStorage.getItem(KEY) !== null;
    this.isDecided = true;
    if (!(isInvited && isMock) && !isWelcome({ wasSeen, isMock, page: router.route.page, isBusy })) return;
    this.isShown = true;
    localStorage.setItem(KEY, 'seen');
  }

  leave(): void {
    this.isShown = false;
    if (!router.route.query.has('tour')) return;
    router.replace('live');
  }
}

export const tourVisit = new TourVisit();
