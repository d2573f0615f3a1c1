"""Says in which encoding a Python file is, and which encodings are decoded."""

from __future__ import annotations

import encodings
import encodings.aliases
import tokenize

#: Encodings in which editors save programs, by their modules, and others that real programs have, whose declaration is
#: unusual enough to be noticed. All take linear time; `punycode` and `idna` do not.
USUAL = frozenset(
    (
        *("utf_8", "ascii", "latin_1"),
        *(f"iso8859_{part}" for part in range(1, 17)),
        *(f"cp125{part}" for part in range(9)),
    )
)
UNUSUAL = frozenset(
    [
        "gbk",
        "gb2312",
        "gb18030",
        "big5",
        "big5hkscs",
        "cp950",
        "shift_jis",
        "cp932",
        "euc_jp",
        "euc_kr",
        "cp949",
        "koi8_r",
        "koi8_u",
        "mac_roman",
        "cp437",
        "cp850",
        "cp866",
        "tis_620",
    ]
)
#: How much of a file is searched for its encoding, which stands in the first two lines.
HEAD_BYTES = 400
#: What UTF-8 may begin with.
BOM = b"\xef\xbb\xbf"


def encoding_of(content: bytes) -> str:
    """Return the encoding that a file declares, as the name of its module; UTF-8 if it declares none."""
    for line in content[:HEAD_BYTES].removeprefix(BOM).split(b"\n", 2)[:2]:
        text = line.decode("latin-1")
        found = tokenize.cookie_re.match(text)
        if found is not None:
            return _module_of(found[1])
        if text.strip() and not text.lstrip().startswith("#"):
            break
    return "utf_8"


def _module_of(name: str) -> str:
    plain = encodings.normalize_encoding(name).lower()
    # Python takes these with anything behind them, such as `utf-8-unix`
    for begin, module in (("utf_8", "utf_8"), ("latin_1", "latin_1"), ("iso_8859_1_", "latin_1")):
        if plain == begin.rstrip("_") or plain.startswith(f"{begin.rstrip('_')}_"):
            return module
    return encodings.aliases.aliases.get(plain, plain)
