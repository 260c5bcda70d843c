// The global that trials.js (written by dav_gswt_study.forced_choice.kit) defines: lists of [item, left, right].
declare const STUDY: { study: string; seconds: number; lists: [string, string, string][][] };
