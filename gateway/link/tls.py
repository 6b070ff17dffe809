"""Modbus/TCP Security: the same frames inside TLS, with a certificate for either side.

The PLC's certificate has to come from the configured authority and name the configured host. Ours
tells the PLC who we are; which role that is, the PLC decides (MODBUS/TCP Security Protocol
Specification, v21, sections 8 and 9). The specification reserves port 802.
"""

import select
import socket
import ssl

from gateway.configuration.sections import PlcConfig
from gateway.errors import ConfigError


def context(plc: PlcConfig) -> ssl.SSLContext | None:
    """Context of the connections to a PLC; None: they are plain. Raises ConfigError."""
    paths = {
        "tls_authority": plc.tls_authority,
        "tls_certificate": plc.tls_certificate,
        "tls_key": plc.tls_key,
    }
    missing = [key for key, path in paths.items() if path is None]
    if len(missing) == len(paths):
        return None
    if missing:
        expected = "all three of tls_authority, tls_certificate and tls_key, or none"
        raise ConfigError("missing", place=f"[plc] {missing[0]}", expected=expected)
    made = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    made.minimum_version = ssl.TLSVersion.TLSv1_2
    key = "tls_authority"
    try:
        made.load_verify_locations(str(plc.tls_authority))
        key = "tls_certificate, tls_key"
        made.load_cert_chain(str(plc.tls_certificate), str(plc.tls_key))
    except OSError as error:  # an SSLError is one, too
        found = " and ".join(str(paths[name]) for name in key.split(", "))
        raise ConfigError(
            error.strerror or str(error),
            place=f"[plc] {key}",
            value=found,
            expected="a readable PEM file; key and certificate belong together",
        ) from error
    return made


def wrap(connection: socket.socket, made: ssl.SSLContext, host: str) -> ssl.SSLSocket:
    """TLS over a connection that never blocks; the handshake is still to come."""
    return made.wrap_socket(connection, server_hostname=host, do_handshake_on_connect=False)


def has_shaken_hands(connection: ssl.SSLSocket) -> bool:
    """Whether the handshake is over, without waiting. Raises OSError where it fails."""
    try:
        connection.do_handshake()
    except (ssl.SSLWantReadError, ssl.SSLWantWriteError):
        return False
    return True


def receive(connection: socket.socket, within: float) -> bytes | None:
    """Bytes that arrive within this time [s]; none: the peer has closed the connection.

    None: nothing has come yet, or a part of a TLS record only. Raises OSError.
    """
    held = isinstance(connection, ssl.SSLSocket) and connection.pending()
    if not held and not select.select([connection], [], [], within)[0]:
        return None
    try:
        return connection.recv(4096)
    except ssl.SSLWantReadError:
        return None
