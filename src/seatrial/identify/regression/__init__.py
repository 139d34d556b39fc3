"""What is linear in its parameters: least squares, AR and ARX models, K and T of a zigzag."""
