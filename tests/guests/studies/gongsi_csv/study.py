"""尺寸链: a supplier's table in Chinese."""

import tolalloc as ta


def gap(*sizes):
    housing, shaft, washer = sizes
    return housing - shaft - washer


HEADS = {"特性": "id", "类型": "feature", "公称尺寸": "nominal", "上偏差": "plus", "下偏差": "minus", "单位": "unit"}
HEADS |= {"最小公差": "min", "最大公差": "max", "成本": "cost"}
study = ta.Study(
    ta.model(gap, inputs=("箱体", "轴", "垫片"), outputs=("间隙 [mm]",), name="间隙"),
    ta.drawing("table.csv", columns=HEADS),
    limits={"间隙 [mm]": ta.Limit(lower=0.3, upper=0.7)},
    name="gongsi_csv",
)
