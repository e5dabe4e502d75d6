"""How an answer of the server looks: its headers say what a page may do, whatever is answered."""

from email.utils import formatdate
from http import HTTPStatus

#: nothing but what this server sends is run or shown, nothing is sent elsewhere, and no page has it in a frame
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:;"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def reply(code: int, kind: str, text: str, *, closes: bool) -> bytes:
    """An answer, as it is sent.

    Parameters
    ----------
    kind : str
        Media type of the text.
    closes : bool
        Whether the connection ends with it.
    """
    content = text.encode()
    headers = {
        "Server": "jointplay",
        "Date": formatdate(usegmt=True),
        **HEADERS,
        "Content-Type": f"{kind}; charset=utf-8",
        "Content-Length": str(len(content)),
        **({"Connection": "close"} if closes else {}),
    }
    lines = [f"HTTP/1.1 {code} {HTTPStatus(code).phrase}", *(f"{name}: {value}" for name, value in headers.items())]
    return "\r\n".join([*lines, "", ""]).encode() + content
