// Errors that are shown to the person at the screen.

/** What went wrong and what to do, in words for the person at the screen. */
export class PageError extends Error {}

export const REMAKE = "Make the page again with “make run”.";
export const REMAKE_SET = "Make the set again.";
