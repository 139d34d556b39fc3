"""The rules of the road (COLREG 1972) as checks on the tracks of ships."""

from .limits import OPEN_SEA as OPEN_SEA
from .limits import Limit as Limit
from .limits import Limits as Limits
from .roles import Role as Role
from .verdict import Judged as Judged
from .verdict import judge as judge
from .waters import OPEN_WATER as OPEN_WATER
from .waters import Alone as Alone
from .waters import Waters as Waters
from .waters import alone as alone
