"""Key files as lbea-keygen makes them: lines of KIND KEY NAME. Needed where the matcher was started with --key."""
import os

import zmq


def keys_in(file):
    """The keys of a file, by kind."""
    found = {}
    with open(file, encoding="utf-8") as lines:
        for line in lines:
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if len(words) < 2 or words[0] not in ("lbea-secret-key", "lbea-public-key") or len(words[1]) != 40:
                raise ValueError(f"{file}: not a key file; make one with lbea-keygen")
            found[words[0]] = words[1].encode()
    if not found:
        raise ValueError(f"{file}: holds no key; make one with lbea-keygen")
    return found


def client_keys(server_key, key):
    """Socket options for a client. server_key: the matcher's .pub file; key: this program's .key file, which the matcher
    allows, drawn anew when not given. Both None: no keys."""
    if server_key is None:
        if key is not None:
            raise ValueError("a key without the server's public key is of no use; give server_key too")
        return {}
    if key is None:
        public, secret = zmq.curve_keypair()
    else:
        if os.stat(key).st_mode & 0o077:
            raise PermissionError(f"{key}: others may read it; chmod 600 it, or make a new one")
        secret = keys_in(key)["lbea-secret-key"]
        public = zmq.curve_public(secret)
    return {zmq.CURVE_SERVERKEY: keys_in(server_key)["lbea-public-key"], zmq.CURVE_PUBLICKEY: public, zmq.CURVE_SECRETKEY: secret}
