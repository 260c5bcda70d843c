"""A camera rig at the other end of a pseudo-terminal, with faults that can be switched on.

It keeps docs/rig-protocol.md: it acts on a number once, refuses to move before it is homed, and saves a photo into a
folder when its camera is released.
"""

import os
import random
import select
import threading
import time
import tty
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dav_gswt import images
from dav_gswt.active.agents.line import framed, unframed

LIMITS = ((-200.0, 200.0), (0.0, 95.0), (500.0, 9000.0))
HOME = (0.0, 60.0, 5000.0)


@dataclass
class Faults:
    """What goes wrong. Counts are of executed verbs: 2 is the second."""

    lost_in: float = 0.0  # share of bytes that do not reach the rig
    lost_out: float = 0.0  # share of bytes that do not reach the program
    late: float = 0.0  # seconds before every third answer
    twice: bool = False  # every answer comes twice
    garbage: bytes = b""  # before every answer
    silent: tuple[str, ...] = ()  # verbs that are never answered
    asked_twice: tuple[str, ...] = ()  # verbs that are acted on, but only answered when they are asked again
    refused: dict = field(default_factory=dict)  # verb: code and text
    boot_during_move: tuple[int, ...] = ()
    boot_before_shot: tuple[int, ...] = ()
    boot_after_shot: tuple[int, ...] = ()  # the photo is taken, the answer is not given
    boots_in_silence: bool = False  # without ! BOOT
    unasked_during_move: dict = field(default_factory=dict)  # which move: text
    stuck: tuple[int, ...] = ()  # moves that end half-way
    answers: dict = field(default_factory=dict)  # verb: what is answered instead
    camera: str = "good"  # none, slow, cut, two, small; late: of a boot_after_shot, when the rig is homed again


class SimulatedRig:
    """Its port is `port`. Looked at by tests: `seen` (every sound line's number and verb), `done` (verbs that were
    acted on), `ways` (from, to of every move), `photos` (how often the camera was released)."""

    def __init__(self, inbox: Path, faults: Faults | None = None, seed: int = 0, duration: float = 0.02):
        self.inbox, self.faults, self.duration = inbox, faults or Faults(), duration
        self.seen, self.done, self.ways, self.photos = [], [], [], 0
        self._random = random.Random(seed)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._reset()
        self._answers, self._kept = 0, None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        while select.select([self._master], [], [], 0.01)[0]:  # until it has heard all that was sent
            time.sleep(0.005)
        self._ended.set()
        self._thread.join(10)
        os.close(self._master)
        os.close(self._slave)

    def verbs(self, *which: str) -> list[str]:
        """What was acted on, of these verbs."""
        return [verb for verb in self.done if verb in which]

    @property
    def last(self) -> str:
        """The last verb that it heard; to be asked when it has ended."""
        return self.seen[-1][1]

    def _reset(self):
        self._homed, self._memory = False, (None, "")
        self._from = self._to = np.zeros(3)
        self._began = -1e9
        self._event, self._boot_at, self._stop_at = None, None, None

    def _run(self):
        rest = b""
        while not self._ended.is_set():
            self._tick()
            if not select.select([self._master], [], [], 0.002)[0]:
                continue
            rest += self._thinned(os.read(self._master, 1024), self.faults.lost_in)
            *lines, rest = rest.split(b"\n")
            rest = rest[-200:]
            for line in lines:
                if (text := unframed(line + b"\n")) is not None:
                    self._heard(*text.split())

    def _tick(self):
        """What happens half-way of a move."""
        if time.monotonic() - self._began < self.duration / 2:
            return
        if self._boot_at:
            self._boot()
        elif self._event:
            self._say("! " + self._event)
            self._event = None
        elif self._stop_at is not None:
            self._from = self._to = self._stop_at
            self._stop_at = None

    def _boot(self):
        self._reset()
        if not self.faults.boots_in_silence:
            self._say("! BOOT")

    def _heard(self, seq: str, verb: str, *words: str):
        self.seen.append((seq, verb))
        if verb in self.faults.silent:
            return
        if seq == self._memory[0] and verb != "HELLO":
            self._say(self._memory[1])
            return
        said = self._acted(verb, words)
        if said is None:
            return
        self._memory = (seq, f"{seq} {said}")
        if verb not in self.faults.asked_twice:
            self._say(self._memory[1])

    def _acted(self, verb: str, words) -> str | None:
        if verb in self.faults.refused:
            return "ERR " + self.faults.refused[verb]
        if verb in self.faults.answers:
            return self.faults.answers[verb]
        if verb in ("MOVE", "SHOOT") and not self._homed:
            return "ERR LOST home first"
        if verb in ("MOVE", "SHOOT") and self._moving():
            return "ERR BUSY still moving"
        self.done.append(verb)
        return getattr(self, "_" + verb.lower())(*words)

    def _hello(self, version: str) -> str:
        numbers = [value for axis in LIMITS for value in axis] + list(HOME)
        return " ".join(["OK", version, *(f"{v:.3f}" for v in numbers)])

    def _home(self) -> str:
        self._homed = True
        if self._kept:
            self._kept[0].write_bytes(self._kept[1])
            self._kept = None
        self._start(np.array(HOME))
        return "OK"

    def _move(self, *words: str) -> str:
        goal = np.array(words, float)
        if any(not low <= v <= high for v, (low, high) in zip(goal, LIMITS, strict=True)):
            return "ERR RANGE beyond the limits"
        n = len(self.verbs("MOVE"))
        self.ways.append((self._place(), goal))
        self._start(goal)
        self._boot_at = n in self.faults.boot_during_move
        self._event = self.faults.unasked_during_move.get(n)
        self._stop_at = (self._from + self._to) / 2 if n in self.faults.stuck else None
        return "OK"

    def _where(self) -> str:
        state = "lost" if not self._homed else "moving" if self._moving() else "still"
        return " ".join(["OK", state, *(f"{v:.3f}" for v in self._place())])

    def _stop(self) -> str:
        self._from = self._to = self._place()
        self._boot_at, self._event, self._stop_at = None, None, None
        return "OK"

    def _shoot(self) -> str | None:
        n = len(self.verbs("SHOOT"))
        if n in self.faults.boot_before_shot:
            return self._boot()
        self.photos += 1
        self._expose()
        return self._boot() if n in self.faults.boot_after_shot else "OK"

    def _expose(self):
        """Save a photo, as the camera's software would."""
        if self.faults.camera == "none":
            return
        name = f"shot{self.photos:04d}.png"
        made = self.inbox.parent / f"made_{name}"
        noise = np.random.default_rng().random((48, 64, 3)).astype(np.float32)
        images.write(made, noise[:24, :32] if self.faults.camera == "small" else noise)
        data = made.read_bytes()
        if self.faults.camera == "late" and len(self.verbs("SHOOT")) in self.faults.boot_after_shot:
            self._kept = (self.inbox / name, data)
            return
        if self.faults.camera in ("slow", "cut"):
            (self.inbox / name).write_bytes(data[: len(data) // 2])
            if self.faults.camera == "slow":
                threading.Timer(0.15, self._finish, (self.inbox / name, data[len(data) // 2 :])).start()
            return
        (self.inbox / name).write_bytes(data)
        if self.faults.camera == "two":
            (self.inbox / f"again_{name}").write_bytes(data)

    @staticmethod
    def _finish(path: Path, data: bytes):
        with path.open("ab") as file:
            file.write(data)

    def _start(self, goal):
        self._from, self._to, self._began = self._place(), goal, time.monotonic()

    def _moving(self) -> bool:
        return not np.array_equal(self._from, self._to) and time.monotonic() - self._began < self.duration

    def _place(self):
        share = min((time.monotonic() - self._began) / self.duration, 1.0)
        return self._from + share * (self._to - self._from)

    def _say(self, text: str):
        self._answers += 1
        if self.faults.late and self._answers % 3 == 0:
            time.sleep(self.faults.late)
        data = framed(text) * (2 if self.faults.twice else 1)
        os.write(self._master, self._thinned(self.faults.garbage + data, self.faults.lost_out))

    def _thinned(self, data: bytes, share: float) -> bytes:
        return bytes(byte for byte in data if self._random.random() >= share)
