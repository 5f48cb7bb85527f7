"""Signals, and pipes that are closed.

* The first SIGINT, SIGTERM or SIGHUP ends a run within two seconds with 130, 143 or 129. What it has recorded stays as a part that is
  sealed: its status is `interrupted`, and every message is the one of the uninterrupted run.
* The second ends it at once, even while it cannot write.
* Under `nohup` SIGHUP is ignored; SIGSTOP and SIGCONT change nothing.
* `percuss-read` dies of the first one, and leaves nothing of the file that it has begun.
* A reader of standard output that has had enough is no error, a disk that is full is one.
"""

import os
import signal
import time

from common import CASE, Recording, call, end, is_prefix, part_of, start

SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
# from signal to exit [s]
PROMPT, AT_ONCE = 2.0, 1.0
# six seconds instead of a fraction of one
PACE = ["--pace", "1"]


def prove(part):
    """All of the above."""
    reference = part.good(CASE, part.work / "reference.mcap")
    times = 2 if part.quick else 10
    slowest = max(interrupt(part, reference, number, status) for number, status in SIGNALS.items() for _ in range(times))
    second = max(interrupt_twice(part, number) for number in SIGNALS for _ in range(1 if part.quick else 5))
    ignore_hangup(part, reference)
    for _ in range(times):
        stop_and_continue(part, reference)
    for number in SIGNALS:
        interrupt_reader(part, number)
    pipes = closed_pipes(part)
    return f"{3 * times} first signals, {slowest:.2f} s at most; second {second:.2f} s at most; {pipes} closed pipes"


def begin(part, *options, command=()):
    """Starts a run that takes some time, and waits for its part."""
    output = part.folder() / "run.mcap"
    process = start([*command, part.percuss, "run", *CASE, "-o", output, "--quiet", *options])
    while process.poll() is None and not (part_of(output).exists() and part_of(output).stat().st_size > 0):
        time.sleep(0.002)
    return process, output


def interrupt(part, reference, number, status):
    """One signal at a random time; the seconds until the end."""
    what = signal.Signals(number).name
    process, output = begin(part, *PACE)
    time.sleep(part.random.uniform(0, 1.5))
    begun = time.monotonic()
    process.send_signal(number)
    done = end(process, 30)
    seconds = time.monotonic() - begun
    part.check(done.returncode == status, f"{what}: status {done.returncode}: {done.stderr}")
    part.check(seconds < PROMPT, f"{what}: {seconds:.1f} s until the end")
    part.check(not output.exists(), f"{what}: the final name is there")
    if part.check(part_of(output).exists(), f"{what}: there is no part"):
        left = Recording(part_of(output))
        sealed = left.broken is None and left.status == "interrupted"
        part.check(sealed, f"{what}: the part has the status {left.status}, {left.broken}")
        # the last message of the log says how the run ended
        messages = [message for message in left.messages if message[0] != "/log"]
        of_run = [message for message in reference.messages if message[0] != "/log"]
        part.check(is_prefix(messages, of_run), f"{what}: messages that the run does not have")
        verified = call([part.reader, "verify", part_of(output)])
        part.check(verified.returncode == 3, f"{what}: verify: status {verified.returncode}: {verified.stdout}")
    return seconds


def interrupt_twice(part, number):
    """Two signals to a run that cannot end, because no process reads the pipe that it writes to; the seconds until the end."""
    what = f"{signal.Signals(number).name} twice"
    pipe = part.folder() / "pipe.mcap"
    os.mkfifo(pipe)
    held = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        process = start([part.percuss, "run", *CASE, "-o", pipe, "--quiet"])
        time.sleep(1.0)
        process.send_signal(number)
        time.sleep(0.3)
        part.check(process.poll() is None, f"{what}: it has ended after the first: {process.poll()}")
        begun = time.monotonic()
        process.send_signal(number)
        done = end(process, 10)
        seconds = time.monotonic() - begun
    finally:
        os.close(held)
    part.check(done.returncode == -number, f"{what}: status {done.returncode}: {done.stderr}")
    part.check(seconds < AT_ONCE, f"{what}: {seconds:.1f} s until the end")
    return seconds


def interrupt_reader(part, number):
    """A signal to a reader that has begun its output."""
    what = f"{signal.Signals(number).name} to percuss-read"
    run, recording = begin(part, *PACE)
    table = recording.with_name("table.csv")
    process = start([part.reader, "trace", part_of(recording), "--follow", "-o", table])
    left = lambda: [path.name for path in recording.parent.glob("table.csv*")]
    deadline = time.monotonic() + 10
    while not left() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    part.check(left() and not table.exists(), f"{what}: it has not begun, or not under another name: {left()}")
    process.send_signal(number)
    done = end(process, 10)
    part.check(done.returncode == -number, f"{what}: status {done.returncode}: {done.stderr}")
    part.check(not left(), f"{what}: it leaves {left()}")
    run.kill()
    run.wait()


def ignore_hangup(part, reference):
    """A run under `nohup`."""
    process, output = begin(part, "--pace", "6", command=["nohup"])
    process.send_signal(signal.SIGHUP)
    done = end(process)
    part.check(done.returncode == 0, f"nohup: status {done.returncode}: {done.stderr}")
    part.check(output.exists() and Recording(output).masked() == reference.masked(), "nohup: the recording differs")


def stop_and_continue(part, reference):
    """A run that is stopped for a while."""
    process, output = begin(part, "--pace", "12")
    for _ in range(3):
        time.sleep(part.random.uniform(0, 0.2))
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.1)
        process.send_signal(signal.SIGCONT)
    done = end(process)
    part.check(done.returncode == 0, f"SIGSTOP: status {done.returncode}: {done.stderr}")
    part.check(output.exists() and Recording(output).masked() == reference.masked(), "SIGSTOP: the recording differs")


def closed_pipes(part):
    """Programs whose standard output is not read to its end; how many."""
    recording = part.work / "reference.mcap"
    commands = [
        f"'{part.percuss}' cases",
        f"'{part.percuss}' check fig5 2>/dev/null",
        f"'{part.percuss}' layout fig5",
        f"'{part.reader}' info '{recording}'",
        f"'{part.reader}' trace '{recording}'",
        f"'{part.reader}' trace '{recording}' --topic /interface/stress",
        f"'{part.reader}' cat '{recording}'",
        f"'{part.reader}' schema '{recording}'",
        f"'{part.reader}' plot '{recording}'",
        f"'{part.reader}' verify '{recording}'",
        f"'{part.reader}' summary '{recording}'",
    ]
    for command in commands:
        for after in ("head -1", "true"):
            script = f"set -o pipefail; {command} | {after} >/dev/null"
            done = call(["bash", "-c", script])
            part.check(done.returncode == 0 and not done.stderr, f"{command} | {after}: status {done.returncode}: {done.stderr}")
        done = call(["bash", "-c", f"{command} >/dev/full"])
        fails = done.returncode == 1 and ("No space left" in done.stderr or "2>" in command)
        part.check(fails, f"{command} >/dev/full: status {done.returncode}: {done.stderr}")
    return 2 * len(commands)
