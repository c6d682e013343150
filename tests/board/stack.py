"""Bound of the stack of an image, from its machine code: frame sizes along the deepest chain of calls.

    tests/board/stack.py IMAGE              of the whole program
    tests/board/stack.py IMAGE FUNCTION     of one function and what it calls

Sound while every call is direct and no function calls itself; both are checked. One interrupt is added to the whole program: all have
the same priority, so none interrupts another. Faults do not return, and what they overwrite is no longer needed.
"""

import re
import subprocess
import sys

INTERRUPTS = ("DefaultHandler", "SysTick")
# What the core stacks on entry with the FPU in use: 26 words, and one to align (Armv7-M, B1.5.7).
EXCEPTION_FRAME = 4 * (26 + 1)
FUNCTION = re.compile(r"^[0-9a-f]{8} <(.+)>:$")
INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\t(\S+)\s*(.*)$")
TARGET = re.compile(r"<([^>+]+)(\+0x[0-9a-f]+)?>")
REGISTERS = re.compile(r"([a-z]+)(\d*)(?:-[a-z]+(\d+))?")


def pushed(operands):
    """Bytes that a register list `{r4, r5-r7, lr}` or `{d8-d15}` takes."""
    total = 0
    for name, first, last in REGISTERS.findall(operands[operands.index("{"):]):
        count = int(last) - int(first) + 1 if last else 1
        total += count * (8 if name == "d" else 4)
    return total


def frame(operation, operands):
    """Bytes by which one instruction moves the stack pointer down."""
    operation = operation.removesuffix(".w").removesuffix(".n")
    if operation in ("push", "vpush") or operation.startswith("stmdb") and operands.startswith("sp!"):
        return pushed(operands)
    if operation in ("sub", "subw", "sub.w") and operands.startswith("sp,"):
        return int(re.search(r"#(\d+)", operands)[1])
    store = re.search(r"\[sp, #-(\d+)\]!", operands)
    return int(store[1]) if store and operation.startswith("str") else 0


def read(image):
    """Frame size and callees of every function, and the functions with calls through a register."""
    listing = subprocess.run(
        ["arm-none-eabi-objdump", "--disassemble", "--no-show-raw-insn", image],
        check=True, capture_output=True, text=True).stdout
    frames, calls, indirect = {}, {}, set()
    name = None
    for line in listing.splitlines():
        if match := FUNCTION.match(line):
            name = match[1]
            frames.setdefault(name, 0)
            calls.setdefault(name, set())
        elif name and (match := INSTRUCTION.match(line)):
            operation, operands = match[1], match[2].split("@")[0].strip()
            frames[name] += frame(operation, operands)
            if operation.startswith("b") and (target := TARGET.search(match[2])):
                # A branch into the middle of a function is a jump table or a loop, not a call.
                if not target[2] and target[1] != name:
                    calls[name].add(target[1])
            elif operation == "blx" or operation == "bx" and operands != "lr":
                indirect.add(name)
    return frames, calls, indirect


def deepest(name, frames, calls, path=(), known=None):
    """Bytes and chain of the deepest call from `name`."""
    known = {} if known is None else known
    if name in path:
        sys.exit(f"stack.py: {' > '.join(path)} > {name}: recursion has no bound")
    if name not in known:
        below = [deepest(callee, frames, calls, path + (name,), known)
                 for callee in calls.get(name, ()) if callee in frames]
        depth, chain = max(below, default=(0, ()))
        known[name] = (depth + frames[name], (name,) + chain)
    return known[name]


def plain(name):
    """A name without its mangling."""
    return subprocess.run(["arm-none-eabi-c++filt", name], capture_output=True, text=True).stdout.strip()


def symbol(function, frames):
    """The only symbol of a function like `Controller::step`."""
    found = [name for name in frames if function.split("::")[-1] in name and f"::{function}::h" in plain(name)]
    if len(found) != 1:
        sys.exit(f"stack.py: {len(found)} functions {function}: inlined, renamed, or several")
    return found[0]


def main():
    image, functions = sys.argv[1], sys.argv[2:]
    frames, calls, indirect = read(image)
    root, interrupts = (symbol(functions[0], frames), ()) if functions else ("Reset", INTERRUPTS)
    depth, chain = deepest(root, frames, calls)
    interrupt, handler = max((deepest(name, frames, calls) for name in interrupts if name in frames), default=(0, ()))
    reached, waiting = set(), [root, *interrupts]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting.extend(calls.get(name, ()))
    if blind := reached & indirect:
        sys.exit(f"stack.py: calls through a register in {', '.join(sorted(blind))}")
    print(depth + (EXCEPTION_FRAME + interrupt if handler else 0))
    for name in (*chain, *handler):
        print(f"{frames[name]:6} {plain(name)}", file=sys.stderr)


main()
