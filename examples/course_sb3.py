"""A course learned by PPO of stable-baselines3, and a picture of what it does.

    pip install 'seatrial[gym]' stable-baselines3
    python examples/course_sb3.py [STEPS]

Prints the mean reward of twenty episodes before and after, and writes course_sb3.gif where Pillow is installed.
"""

from __future__ import annotations

import sys

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import seatrial as st

ID = "seatrial/Course-v0"


def main(steps: int) -> None:
    if ID not in st.envs.IDS:
        raise SystemExit(f"no environment {ID}")
    agent = PPO("MlpPolicy", make_vec_env(ID, 8, seed=1), n_steps=256, gamma=0.99, seed=1, device="cpu")
    judge = make_vec_env(ID, 1, seed=100)
    before, _ = evaluate_policy(agent, judge, 20)
    agent.learn(steps)
    judge.seed(100)
    after, _ = evaluate_policy(agent, judge, 20)
    print(f"mean reward of 20 episodes: {before:.2f} before, {after:.2f} after {steps} steps")  # noqa: T201
    film(agent)


def film(agent: PPO) -> None:
    """One episode as pictures."""
    try:
        from PIL import Image
    except ImportError:
        return
    env = gymnasium.make(ID, render_mode="rgb_array")
    seen, _ = env.reset(seed=7)
    pictures, over = [np.asarray(env.render())], False
    while not over:
        action, _ = agent.predict(seen, deterministic=True)
        seen, _, ended, cut, _ = env.step(action)
        over = ended or cut
        pictures.append(np.asarray(env.render()))
    first, *rest = [Image.fromarray(one) for one in pictures[::4]]
    first.save("course_sb3.gif", save_all=True, append_images=rest, duration=60)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50_000)
