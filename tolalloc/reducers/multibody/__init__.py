"""The virtual prototype: exact tooth profiles, rigid parts and large motions in a multibody engine made elsewhere."""
