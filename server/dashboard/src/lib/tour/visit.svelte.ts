/** Whether the tour is shown: invited by the address (`#/live?tour`), or at the first start. */

import { live } from '../live/live.svelte';
import { router } from '../router.svelte';
import { isWelcome } from './tour';

const KEY = 'ma2000-tour';

class TourVisit {
  isShown = $state(false);

  /** For an effect: once shown it counts as seen, however soon it is left. */
  watch(): void {
    const { robot } = live;
    const isInvited = router.route.query.has('tour');
    const isMock = robot?.identity?.simulated ?? false;
    const isBusy =
      robot === null || robot.arm === 'stopped' || robot.arm === 'fault' || robot.activity !== 'none';
    const wasSeen = localStorage.getItem(KEY) !== null;
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
