"""All text, JSON, pages and pictures: results are turned into language here and nowhere below.

Of these, pictures (matplotlib figures) and sentences that scripts and notebooks show are named here.
"""

from typing import TYPE_CHECKING

from fitting.lazy import lazily

if TYPE_CHECKING:
    from fitting.report.pictures.design import stroke_of as stroke_of
    from fitting.report.pictures.design import to_scale as to_scale
    from fitting.report.pictures.figures import BLUE as BLUE
    from fitting.report.pictures.figures import GREEN as GREEN
    from fitting.report.pictures.figures import GREY as GREY
    from fitting.report.pictures.figures import ORANGE as ORANGE
    from fitting.report.pictures.figures import SKY as SKY
    from fitting.report.pictures.figures import VERMILION as VERMILION
    from fitting.report.pictures.figures import effects_picture as effects_picture
    from fitting.report.pictures.figures import waterfall as waterfall
    from fitting.report.pictures.hill import speed_over_load as speed_over_load
    from fitting.report.pictures.panels import Panel as Panel
    from fitting.report.pictures.panels import panels as panels
    from fitting.report.pictures.posterior import pairs as pairs
    from fitting.report.text.amounts import with_error as with_error
    from fitting.report.text.comparison import error_text as error_text
    from fitting.report.text.comparison import kind_text as kind_text
    from fitting.report.text.comparison import worst_text as worst_text
    from fitting.report.text.design import describe as design_text  # noqa: F401
    from fitting.report.text.design import prices as price_text  # noqa: F401
    from fitting.report.text.diagnosis import leading_text as leading_text
    from fitting.report.text.diagnosis import verdict_text as verdict_text
    from fitting.report.text.names import readable as readable
else:
    __getattr__, __dir__ = lazily(
        __name__,
        {
            **dict.fromkeys(("BLUE", "GREEN", "GREY", "ORANGE", "SKY", "VERMILION"), "pictures.figures"),
            **dict.fromkeys(("effects_picture", "waterfall"), "pictures.figures"),
            **dict.fromkeys(("stroke_of", "to_scale"), "pictures.design"),
            "speed_over_load": "pictures.hill",
            **dict.fromkeys(("Panel", "panels"), "pictures.panels"),
            "pairs": "pictures.posterior",
            "with_error": "text.amounts",
            **dict.fromkeys(("error_text", "kind_text", "worst_text"), "text.comparison"),
            "design_text": "text.design:describe",
            "price_text": "text.design:prices",
            **dict.fromkeys(("leading_text", "verdict_text"), "text.diagnosis"),
            "readable": "text.names",
        },
    )
