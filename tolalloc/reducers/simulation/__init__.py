"""A reducer through a speed and a torque profile, beside the static model."""
