"""A long short-term memory network (PyTorch) of past velocities and inputs that answers with the next change."""

from __future__ import annotations

import numpy as np
import torch
from common import Series, Step, main, pairs
from torch import nn

LAGS = 16
_EPOCHS, _BATCH, _HIDDEN, _MOST = 40, 256, 32, 12000


class Network(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.lstm, self.head = nn.LSTM(width, _HIDDEN, batch_first=True), nn.Linear(_HIDDEN, 3)

    def forward(self, past: torch.Tensor) -> torch.Tensor:
        return self.head(self.lstm(past)[0][:, -1])


def fit(series: list[Series]) -> Step:
    torch.manual_seed(0)
    before, acting, after = pairs(series, LAGS)
    some = np.random.default_rng(0).permutation(len(after))[:_MOST]
    past = torch.tensor(np.concatenate([before, acting], axis=2)[some], dtype=torch.float32)
    change = (after - before[:, -1])[some]
    size = change.std(axis=0)
    wanted = torch.tensor(change / size, dtype=torch.float32)
    network = Network(past.shape[2])
    optimiser = torch.optim.Adam(network.parameters(), 3e-3)
    for _ in range(_EPOCHS):
        for rows in torch.randperm(len(past)).split(_BATCH):
            # noise on the past keeps a free run from feeding on its own small errors
            noisy = past[rows] + 0.02 * torch.randn_like(past[rows])
            loss = ((network(noisy) - wanted[rows]) ** 2).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()

    def step(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            found = network(torch.tensor(np.concatenate([velocity, inputs], axis=2), dtype=torch.float32))
        return velocity[:, -1] + found.numpy().astype(float) * size

    return step


if __name__ == "__main__":
    main(fit, LAGS)
