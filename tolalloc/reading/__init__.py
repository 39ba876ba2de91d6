"""The door through which the user's files and arguments come in.

`files` reads TOML and finds shipped or the user's own files, every fault one sentence; `file_content` refuses what is
no file; `plugins` finds what other installed packages bring. `named_fields` makes records whose fields say what they
allow; `units` has the factors to SI and the units in names.
"""
