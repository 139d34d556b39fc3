"""What this installation can do on this machine."""

from .doctor import Finding as Finding
from .doctor import examine as examine
