/** The guided tour: what it shows, and when it comes by itself. Pure. */

export interface Stop {
  title: string;
  text: string;
  /** What it is about: a selector; nothing is marked where there is no such thing. */
  about: string;
}

export const STOPS: readonly Stop[] = [
  {
    title: 'This arm is a mock',
    text: 'A program plays the arm: nothing real moves, so press whatever you like. What it does, and the next step, are here.',
    about: '.home',
  },
  {
    title: 'Stop is on every page',
    text: 'It stops the arm when pressed and asks nothing. On a keyboard F8 does the same, also while you type.',
    about: 'header .stop',
  },
  {
    title: 'What you see is live',
    text: 'The charts show position, error and drive of each joint as they come. Arrange the panels as you like them.',
    about: '[data-kind="charts"], [data-kind="chart"]',
  },
  {
    title: 'Every run leaves a trace',
    text: 'Start an experiment, then lay its trace over others: overlay, difference, spectrum.',
    about: 'nav a[href="#/traces"]',
  },
  {
    title: 'Now let the mock hide something from you',
    text: 'The mock changes one thing about the arm and tells nobody. The diagnosis finds it from the motion alone.',
    about: 'a[href="#/diagnosis/hide"]',
  },
];

export interface Visit {
  /** Whether it was shown in this browser before, or might have been on this visit. */
  wasSeen: boolean;
  isMock: boolean;
  page: string;
  /** Whether something moves, is stopped or is at fault: nobody is disturbed then. */
  isBusy: boolean;
}

/** Whether the tour may come without being asked for: on a mock at rest, once. */
export function isWelcome({ wasSeen, isMock, page, isBusy }: Visit): boolean {
  return !wasSeen && isMock && !isBusy && (page === '' || page === 'live');
}
