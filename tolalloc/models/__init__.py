"""What is asked: models, their settings, own functions.

`model.Model` is what every question asks: columns in, outputs with statuses out; `function_model.model` makes one of
a function. `settings.Setting` may be chosen beside the zones. `identity` tells one model from another, `checkpoint`
asks nothing twice, `unit_bounds` says what no unit can be below.
"""
