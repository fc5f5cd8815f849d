"""Checks that wheels to hand out have the studio's page, which git does not know (``make wheels``).

python scripts/check_wheels.py WHEEL...
"""

import sys
import zipfile

PAGE = "trabecula/command/studio.html"


def main() -> None:
    """Ends with status 1 and a sentence where a wheel has no page, or none was named."""
    wheels = sys.argv[1:]
    bare = [wheel for wheel in wheels if PAGE not in zipfile.ZipFile(wheel).namelist()]
    if bare:
        again = "`make studio` makes it; where that does nothing, remove build/studio first"
        sys.exit(f"{', '.join(bare)}: no {PAGE}; {again}")
    if not wheels:
        sys.exit("no wheels: name those to check")


if __name__ == "__main__":
    main()
