"""What a person does: add a tool, record, answer, teach, plan, preview. REST and the 3D view offer the same actions."""
