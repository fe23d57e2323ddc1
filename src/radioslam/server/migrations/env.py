"""How Alembic runs the steps: on the connection that ``Database.migrate`` hands over, in its transaction."""

from alembic import context

from radioslam.server.tables import Table

context.configure(
    connection=context.config.attributes["connection"], target_metadata=Table.metadata, render_as_batch=True
)
context.run_migrations()
