"""Key files of lbea-keygen: lines of KIND KEY NAME. Needed when the matcher was started with --key."""
import os

import zmq


def keys_in(file):
    """Returns the keys of a file by kind. Raises ValueError when it is not a key file."""
    found = {}
    with open(file, encoding="utf-8") as lines:
        for line in lines:
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if len(words) < 2 or words[0] not in ("lbea-secret-key", "lbea-public-key") or len(words[1]) != 40:
                raise ValueError(f"{file}: not a key file; create one with lbea-keygen")
            found[words[0]] = words[1].encode()
    if not found:
        raise ValueError(f"{file}: contains no key; create one with lbea-keygen")
    return found


def client_keys(server_key, key):
    """Returns the socket options of a client. server_key: the .pub file of the matcher. key: the .key file of this
    program, which the matcher must allow; default: a random key. Both None: no keys."""
    if server_key is None:
        if key is not None:
            raise ValueError("key needs server_key, the public key of the server")
        return {}
    if key is None:
        public, secret = zmq.curve_keypair()
    else:
        if os.stat(key).st_mode & 0o077:
            raise PermissionError(f"{key}: other users can read it; chmod 600 it, or create a new one")
        secret = keys_in(key)["lbea-secret-key"]
        public = zmq.curve_public(secret)
    return {zmq.CURVE_SERVERKEY: keys_in(server_key)["lbea-public-key"], zmq.CURVE_PUBLICKEY: public, zmq.CURVE_SECRETKEY: secret}
