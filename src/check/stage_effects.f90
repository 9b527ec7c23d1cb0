! SPDX-License-Identifier: MIT
!> Blocks that stages excavate and place: how many, and what goes and comes with them (points, loads, bolts,
!> boundaries).
module rockdda_check_stage_effects
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : counted
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : blocks_of_region
   use rockdda_model_stage_options, only : stage_name, is_given
   use rockdda_interaction_boundary_edges, only : find_outer_edges, edges_along
   use rockdda_interaction_line_loads, only : find_carriers
   implicit none
   private
   public :: report_stage_effects

   !> Text behind the number of things.
   character(len=*), parameter :: goes_along = 'on excavated blocks, without effect from then on', &
      comes_along = 'on placed blocks, with effect from then on', &
      bolt_goes = 'with an end in excavated blocks: their force is released with the excavation', &
      bolt_comes = 'with an end in placed blocks, with their pretension from then on'

contains

   !> The number of blocks that each stage places and takes out; a warning for each kind of thing on blocks that go, but
   !> a note for edges of boundaries, and a note for each on blocks that come. Errors: a stage takes out the last block,
   !> or blocks that it places. The names of the regions have been checked.
   subroutine report_stage_effects(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      logical :: there(blocks%n_blocks), goes(blocks%n_blocks), comes(blocks%n_blocks)
      integer, allocatable :: carriers(:), edge_blocks(:)
      integer :: i
      if (.not. allocated(parameters%regions)) return
      if (.not. any_builds(parameters)) return
      call find_places(blocks, parameters, carriers, edge_blocks)
      ! absent at the start are blocks that are placed before they are excavated, if ever
      there = .true.
      goes = .false.
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i))
            if (is_given(stage%place)) there = there .and. (goes .or. .not. in_regions(stage%place))
            if (is_given(stage%excavate)) goes = goes .or. in_regions(stage%excavate)
         end associate
      end do
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i), name => "&stage '"//stage_name(parameters%stages, i)//"'")
            if (is_given(stage%place)) then
               comes = in_regions(stage%place) .and. .not. there
               call report_number(name//' places ', count(comes), stage%origin, messages)
               call report(comes, name//':', comes_along, bolt_comes, severity%note, stage%origin)
               there = there .or. comes
            end if
            if (.not. is_given(stage%excavate)) cycle
            goes = in_regions(stage%excavate) .and. there
            call report_number(name//' excavates ', count(goes), stage%origin, messages)
            if (is_given(stage%place)) then
               if (any(goes .and. in_regions(stage%place))) call messages%add(severity%error, name// &
                  ' places and excavates the same blocks', stage%origin)
            end if
            call report(goes, name//':', goes_along, bolt_goes, severity%warning, stage%origin)
            there = there .and. .not. goes
            if (.not. any(there)) call messages%add(severity%error, name//' excavates the last block', stage%origin)
         end associate
      end do

   contains

      !> Blocks of some regions.
      function in_regions(names)
         character(len=*), intent(in) :: names
         logical :: in_regions(blocks%n_blocks)
         in_regions = blocks_of_region(blocks, parameters%regions, names)
      end function in_regions

      !> What is on some blocks.
      subroutine report(chosen, name, words, bolt_words, level, origin)
         logical, intent(in) :: chosen(:)
         character(len=*), intent(in) :: name, words, bolt_words
         integer, intent(in) :: level
         type(origin_type), intent(in) :: origin
         character(len=max(len(name), len(words), len(bolt_words))) :: around(2)
         around = name
         around(2) = words
         call count_all(blocks, chosen, carriers, edge_blocks, around, level, origin, messages)
         around(2) = bolt_words
         call count_bolts(blocks, chosen, around, level, origin, messages)
      end subroutine report

   end subroutine report_stage_effects

   !> A note with a number of blocks, a warning where there are none.
   subroutine report_number(what, n, origin, messages)
      character(len=*), intent(in) :: what
      integer, intent(in) :: n
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      call messages%add(merge(severity%note, severity%warning, n > 0), what//counted(n, 'block'), origin)
   end subroutine report_number

   !> Does a stage excavate or place blocks?
   pure logical function any_builds(parameters)
      type(parameters_type), intent(in) :: parameters
      integer :: i
      any_builds = .false.
      if (.not. allocated(parameters%stages)) return
      do i = 1, size(parameters%stages)
         any_builds = any_builds .or. is_given(parameters%stages(i)%excavate) .or. &
                      is_given(parameters%stages(i)%place)
      end do
   end function any_builds

   !> Blocks that carry the line loads, and those of the edges of boundaries.
   subroutine find_places(blocks, parameters, carriers, edge_blocks)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, allocatable, intent(out) :: carriers(:)      !! (line loads), 0: none
      integer, allocatable, intent(out) :: edge_blocks(:)   !! (edges)
      type(diagnostics_type) :: told_elsewhere
      logical, allocatable :: outer(:)
      integer, allocatable :: edges(:), their_blocks(:)
      real(wp), allocatable :: normals(:, :)
      real(wp) :: tolerance
      integer :: g
      allocate (carriers(size(parameters%line_loads)), edge_blocks(0))
      call find_carriers(blocks, parameters, carriers, told_elsewhere)
      if (.not. allocated(parameters%boundaries)) return
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      outer = find_outer_edges(blocks, tolerance)
      do g = 1, size(parameters%boundaries)
         if (.not. allocated(parameters%boundaries(g)%along)) cycle
         call edges_along(blocks, outer, parameters%boundaries(g)%along, tolerance, edges, their_blocks, normals)
         edge_blocks = [edge_blocks, their_blocks]
      end do
   end subroutine find_places

   !> Count points, line loads and edges of boundaries on some blocks, a message for each kind.
   subroutine count_all(blocks, chosen, carriers, edge_blocks, words, level, origin, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)                         !! (nb)
      integer, intent(in) :: carriers(:), edge_blocks(:)       !! blocks of line loads and of edges, 0: none
      character(len=*), intent(in) :: words(2)                 !! before and after the number
      integer, intent(in) :: level                             !! one of severity%..., but of edges a note
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      if (blocks%fixed%n > 0) call report(blocks%fixed%block(1:blocks%fixed%n), 'fixed point', level)
      if (blocks%loading%n > 0) call report(blocks%loading%block(1:blocks%loading%n), 'loading point', level)
      call report(carriers, 'line load', level)
      if (blocks%measured%n > 0) call report(blocks%measured%block(1:blocks%measured%n), 'measured point', level)
      ! an edge that is gone needs no support: who takes out a centring takes out what holds it, too
      call report(edge_blocks, 'boundary edge', severity%note)

   contains

      !> Those of one kind.
      subroutine report(on, noun, level)
         integer, intent(in) :: on(:)     !! blocks
         character(len=*), intent(in) :: noun
         integer, intent(in) :: level     !! one of severity%...
         integer :: i, n
         n = 0
         do i = 1, size(on)
            if (is_one_of(chosen, on(i))) n = n + 1
         end do
         if (n > 0) call messages%add(level, trim(words(1))//' '//counted(n, noun)//' '//trim(words(2)), origin)
      end subroutine report

   end subroutine count_all

   !> Count the bolts with an end in some blocks.
   subroutine count_bolts(blocks, chosen, words, level, origin, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)                         !! (nb)
      character(len=*), intent(in) :: words(2)                 !! before and after the number
      integer, intent(in) :: level                             !! one of severity%...
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      integer :: l, n
      n = 0
      do l = 1, blocks%bolts%n
         associate (pair => blocks%bolts%blocks(:, l))
            if (is_one_of(chosen, pair(1)) .or. is_one_of(chosen, pair(2))) n = n + 1
         end associate
      end do
      if (n > 0) call messages%add(level, trim(words(1))//' '//counted(n, 'bolt')//' '//trim(words(2)), origin)
   end subroutine count_bolts

   !> Is a block, 0 for none, one of those chosen?
   pure logical function is_one_of(chosen, block)
      logical, intent(in) :: chosen(:)
      integer, intent(in) :: block
      is_one_of = .false.
      if (block > 0) is_one_of = chosen(block)
   end function is_one_of

end module rockdda_check_stage_effects
