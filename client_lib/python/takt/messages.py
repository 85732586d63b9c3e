"""Messages that a client receives, as classes with read-only properties. idl/takt_msgs.idl is their source.

Times are s of simulated time, numbers SI, quaternions x y z w. An array is a copy: what is written into it changes nothing
else. Frames: W the world (z up), B the component's own.
"""

from ._takt.messages import *  # noqa: F401,F403
